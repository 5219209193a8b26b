"""Whose answer is missing: what motion can tell from liveliness and health."""

from fras_common.messages import Health
from fras_common.service import ServiceHost
from fras_common.topics import HEALTH


class Peers:
    """The two services that stand between a robot state and its verdict."""

    def __init__(self, host: ServiceHost) -> None:
        self._host = host
        self._sim_tick: int | None = None
        host.subscribe(HEALTH.of(service="sim"), self._on_health)

    def _on_health(self, health: Health) -> None:
        self._sim_tick = health.tick if health.trial == self._host.gate.trial else None

    def missing(self, tick: int) -> str:
        """Name the service that has not answered on `tick`, as far as can be told."""
        for service in ("sim", "sa"):
            if not self._host.present(f"alive/{service}"):
                return service
        behind = self._sim_tick is not None and self._sim_tick < tick
        return "sim" if behind else "sa"
