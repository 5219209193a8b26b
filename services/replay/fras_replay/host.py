"""How a replay is seen by others: as what it is, never as one of the services that it plays."""

from collections.abc import Callable

from fras_common.service import ServiceHost
from fras_replay.cell import NAME

__all__ = ["ReplayHost"]


class ReplayHost(ServiceHost):
    """A host whose health says that what is heard here is a replay."""

    def __init__(self) -> None:
        super().__init__(NAME)
        self.telling: Callable[[], str] = lambda: "starting"

    @property
    def state(self) -> str:
        """`replay: ` and where it stands."""
        return f"replay: {self.telling()}"
