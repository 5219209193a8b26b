"""No action is awaited for ever: motion, away for too long, is given up; time is an argument."""

from fras_common.service import ServiceHost
from fras_planner.endings import PeerLost
from fras_planner.performer import Performer

__all__ = ["MotionWatch"]

WATCH_S = 0.5


class MotionWatch:
    """Gives up on an action whose motion is away for too long.

    Parameters
    ----------
    host : ServiceHost
    performer : Performer
        Awaits the action's end.
    """

    def __init__(self, host: ServiceHost, performer: Performer) -> None:
        self._host = host
        self._performer = performer
        self._peer_timeout_s = 0.0
        self._gone_since_s: float | None = None

    def begin(self, peer_timeout_s: float) -> None:
        """Wait for so long from now on."""
        self._peer_timeout_s = peer_timeout_s

    def wake(self, now_s: float) -> float | None:
        """Look whether motion is there; seconds until that has to be asked again, or None.

        Parameters
        ----------
        now_s : float [s]
            Monotonic clock.
        """
        if not self._performer.awaited:
            self._gone_since_s = None
            return None
        # One that starts again is alive before it knows what it was about to do.
        if self._host.present("ready/motion"):
            self._gone_since_s = None
            return WATCH_S
        if self._gone_since_s is None:
            self._gone_since_s = now_s
        self._host.waiting_for = "motion"
        if now_s - self._gone_since_s > self._peer_timeout_s:
            self._host.waiting_for = ""
            self._performer.drive(PeerLost("motion is gone", service="motion"))
        return WATCH_S
