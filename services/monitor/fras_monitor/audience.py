"""Who looks at the page: said four times a second, so that nothing moves unsupervised."""

from typing import Final

from fras_common.messages import Presence
from fras_common.service import ServiceHost
from fras_common.topics import PRESENCE
from fras_monitor.pace import Due
from fras_monitor.page.hub import Hub

__all__ = ["Audience"]

PRESENCE_S: Final = 0.25


class Audience:
    """Counts the pages that are open, and says how many, at once where that changes.

    Parameters
    ----------
    host : ServiceHost
    """

    def __init__(self, host: ServiceHost) -> None:
        self._host = host
        self._due = Due(PRESENCE_S)
        self._looking = (0, 0)
        self._presence = host.publisher(PRESENCE)

    def tell(self, hub: Hub, address: str, now_s: float) -> None:
        """Say who looks now, if it is time to.

        Parameters
        ----------
        hub : Hub
            Knows the pages.
        address : str
            Where they are opened.
        now_s : float [s]
            Monotonic clock.
        """
        looking = hub.counts(now_s)
        if self._due.take(now_s) or looking != self._looking:
            self._looking = looking
            surgeons, viewers = looking
            self._presence.put(Presence(viewers=surgeons, read_only=viewers))
            self._host.facts |= {"pages": str(surgeons + viewers), "address": address}
