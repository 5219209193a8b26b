"""Whose answer is missing: what motion can tell from liveliness and health."""

from collections.abc import Callable

from fras_common.messages import Health
from fras_common.service import ServiceHost
from fras_common.topics import HEALTH, PATIENT

_LOOP = ("sim", "sa")
_SAID_AGAIN = (*_LOOP, PATIENT.service)


class Peers:
    """The services that stand between a robot state and its verdict.

    Parameters
    ----------
    host : ServiceHost
    on_return : callable
        Called when one of them has come, for the first time or again.
    """

    def __init__(self, host: ServiceHost, on_return: Callable[[], None]) -> None:
        self._host = host
        self._on_return = on_return
        self._sim_tick: int | None = None
        self._sa_waits_for_patient = False
        host.subscribe(HEALTH.of(service="sim"), self._on_health)
        host.subscribe(HEALTH.of(service="sa"), self._on_sa_health)
        host.bus.watch_tokens(self._on_token)

    def _on_health(self, health: Health) -> None:
        self._sim_tick = health.tick if health.trial == self._host.gate.trial else None

    def _on_sa_health(self, health: Health) -> None:
        waits = health.state == f"waiting: {PATIENT.service}"
        self._sa_waits_for_patient = waits and health.trial == self._host.gate.trial

    def _on_token(self, token: str, present: bool) -> None:
        if present and token.startswith(tuple(f"ready/{service}/" for service in _SAID_AGAIN)):
            self._host.post(self._on_return)

    def missing(self, tick: int) -> str:
        """Name the service that has not answered on `tick`, as far as can be told."""
        for service in _LOOP:
            if not self._host.present(f"alive/{service}"):
                return service
        behind = self._sim_tick is not None and self._sim_tick < tick
        if behind:
            return "sim"
        # Only SA knows whether the trial has one, and that it lacks its state.
        return PATIENT.service if self._sa_waits_for_patient else "sa"
