"""No trial goes on unrecorded: a recorder that has come back opens the log again, or it ends."""

from fras_common.bus import NoAnswer
from fras_common.errors import FrasError
from fras_common.messages import RecorderStatus, ResetReply
from fras_common.service import ServiceHost
from fras_common.topics import RECORDER_OPEN, RECORDER_STATUS
from fras_planner.endings import TaskAborted
from fras_planner.executive import Executive
from fras_planner.performer import Performer
from fras_planner.requests import REOPEN_TIMEOUT_S

__all__ = ["LogWatch"]


class LogWatch:
    """Has a recorder that has just started go on with the log; ends the trial of a lost one.

    Parameters
    ----------
    host : ServiceHost
    performer : Performer
        Drives the executive whose log it is.
    """

    def __init__(self, host: ServiceHost, performer: Performer) -> None:
        self._host = host
        self._performer = performer
        self._running: Executive | None = None
        self._is_required = True
        host.subscribe(RECORDER_STATUS, self._on_status)

    def begin(self, running: Executive, *, required: bool) -> None:
        """Watch the log of a trial from now on; without it the trial ends if it demands one."""
        self._running = running
        self._is_required = required

    def end(self) -> None:
        """Watch no more: the trial is over."""
        self._running = None

    def _on_status(self, status: RecorderStatus) -> None:
        running = self._running
        if running is None:
            return
        if status.state == "idle" and running.log_open:
            self._reopen(running)
        elif status.state == "error" and status.trial == running.status.trial:
            self._lose(running, status.reason)

    def _reopen(self, running: Executive) -> None:
        def reopened(outcome: ResetReply | FrasError) -> None:
            if running is not self._running or not isinstance(outcome, FrasError):
                return
            self._host.log.error("the log is not gone on with", problem=str(outcome))
            # One that does not answer has gone again; the next one will say that it is there.
            if not isinstance(outcome, NoAnswer):
                self._lose(running, str(outcome))

        self._host.bus.ask(
            RECORDER_OPEN,
            running.log_request,
            lambda outcome: self._host.post(lambda: reopened(outcome)),
            REOPEN_TIMEOUT_S,
        )

    def _lose(self, running: Executive, reason: str) -> None:
        """End the trial whose log can't be written any more: nothing moves unrecorded."""
        if self._is_required and not running.ending:
            self._performer.drive(TaskAborted(f"hold:recorder: {reason}"))
