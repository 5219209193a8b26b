"""Who holds the arms: asked and answered at any time, each change said before it is answered."""

from fras_common import messages as m
from fras_common.service import ServiceHost
from fras_common.topics import HOLD, HOLDS, RESUME
from fras_motion.holds import Holds

__all__ = ["HoldDesk"]


class HoldDesk:
    """Serves `motion/hold` and `motion/resume` past the inbox.

    Parameters
    ----------
    host : ServiceHost

    Attributes
    ----------
    holds : Holds
    """

    def __init__(self, host: ServiceHost) -> None:
        self._host = host
        self._said = host.publisher(HOLDS)
        # Before the answer to whoever changed them: what is acknowledged survives this process.
        self.holds = Holds(lambda holds: self._say(holds))

    def open(self) -> None:
        """Take requests from now on."""
        self._host.serve_at_once(HOLD, self._hold)
        self._host.serve_at_once(RESUME, self._resume)

    def _say(self, holds: dict[str, str]) -> None:
        self._said.put(m.Holds(holds=holds))

    def _hold(self, request: m.HoldRequest) -> m.HoldState:
        # On the receiving thread: the stop must not wait behind anything.
        holds = self.holds.hold_for_client(request.holder, request.reason)
        self._host.tell("held", "info", "held", by=request.holder)
        return m.HoldState(holds=holds, tick=self._host.tick)

    def _resume(self, request: m.ResumeRequest) -> m.HoldState:
        holds = self.holds.resume_for_client(request.holder, request.by)
        self._host.tell("hold lifted", "info", "hold lifted", of=request.holder)
        return m.HoldState(holds=holds, tick=self._host.tick)
