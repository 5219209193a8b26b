"""The log that is open, and what is told of it."""

from fras_common.messages import OpenRequest, RecorderStatus
from fras_common.messages.recorder import LogState
from fras_common.service import ServiceHost
from fras_common.topics import RECORDER_STATUS
from fras_recorder.writing import Facts

__all__ = ["LogStatus"]


class LogStatus:
    """Says on `recorder/status` how the log stands.

    Parameters
    ----------
    host : ServiceHost

    Attributes
    ----------
    request : OpenRequest or None
        What opened it; None while none is open.
    facts : Facts
        How far it was when last told.
    """

    def __init__(self, host: ServiceHost) -> None:
        self.request: OpenRequest | None = None
        self.facts = Facts()
        self._status = host.publisher(RECORDER_STATUS)

    def begin(self, request: OpenRequest, facts: Facts) -> None:
        """Have a log open from now on; it is told of by `tell_behind`."""
        self.request, self.facts = request, facts

    def tell(self, state: LogState, reason: str = "", facts: Facts | None = None) -> None:
        """Say how it stands."""
        self.facts = facts or self.facts
        status = RecorderStatus(
            trial=self.request.trial if self.request is not None else "",
            state=state,
            path=self.facts.path,
            messages=self.facts.messages,
            bytes=self.facts.bytes,
            lost=self.facts.lost,
            reason=reason,
        )
        self._status.put(status)

    def tell_behind(self, *, behind: bool, waiting: int) -> None:
        """Say whether what is heard is written as fast; `waiting` messages are not yet."""
        if self.request is not None:
            reason = f"{waiting} messages wait to be written" if behind else ""
            self.tell("behind" if behind else "recording", reason)

    def end(self, state: LogState, reason: str, facts: Facts) -> None:
        """Say how it ended; none is open then."""
        self.tell(state, reason, facts)
        self.request = None
