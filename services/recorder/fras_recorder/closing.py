"""How a log is closed: once it is complete and nothing more comes, or waiting for that is over."""

import time

from fras_common.errors import FrasError
from fras_common.messages import CloseReply, CloseRequest
from fras_common.service import Deferred, ServiceHost
from fras_common.topics import RECORDER_CLOSE
from fras_recorder.log_status import LogStatus
from fras_recorder.opening import Opening
from fras_recorder.writing import Facts, Writing

__all__ = ["Closing", "LogFailed", "NothingToClose"]

QUIET_S = 0.05
CLOSE_TIMEOUT_S = 3.0


class NothingToClose(FrasError):
    """No log is open for the trial named."""


class LogFailed(FrasError):
    """The log that was to be closed can't be written."""


class Closing:
    """Serves `recorder/close`.

    Parameters
    ----------
    host : ServiceHost
    writing : Writing
    log : LogStatus
    opening : Opening
        Keeps what is asked of a log that is not open yet.
    """

    def __init__(
        self, host: ServiceHost, writing: Writing, log: LogStatus, opening: Opening
    ) -> None:
        self._host = host
        self._writing = writing
        self._log = log
        self._opening = opening
        self._closing: Deferred[CloseRequest, CloseReply] | None = None
        self._close_by_s = 0.0
        self._is_finishing = False
        host.serve_deferred(RECORDER_CLOSE, self._begin)

    def _begin(self, pending: Deferred[CloseRequest, CloseReply]) -> None:
        trial = pending.request.trial
        if self._opening.keep(trial, lambda: self._begin(pending)):
            return
        if self._log.request is None or trial != self._log.request.trial:
            pending.fail(NothingToClose(f"no log is open for trial {trial!r}"))
            return
        if self._closing is not None:
            self._closing.fail(NothingToClose("superseded by a later request to close this log"))
        self._closing = pending
        self._close_by_s = time.monotonic() + CLOSE_TIMEOUT_S

    def wake(self) -> float | None:
        """Close the log when it is complete; seconds until that has to be asked again, or None."""
        if self._closing is None or self._is_finishing:
            return None
        request, now_s = self._closing.request, time.monotonic()
        complete = self._writing.seen.reached(request.last_tick, request.status_seq)
        # Mirrors of queries may still be under way; they are not numbered by tick.
        quiet = not self._writing.waiting and now_s - self._writing.last_arrival_s >= QUIET_S
        if not (complete and quiet) and now_s < self._close_by_s:
            return QUIET_S
        if not complete:
            self._host.log.warning("log closed incomplete", trial=request.trial)
        self._is_finishing = True
        self._writing.close("closed", lambda facts: self.end("closed", facts))
        return None

    def end(self, reason: str, facts: Facts | None) -> None:
        """Say that the log is finished; if it failed instead, that has been said."""
        self._is_finishing = False
        if facts is None:
            return
        self._log.end("closed", reason, facts)
        pending, self._closing = self._closing, None
        if pending is not None:
            reply = CloseReply(path=facts.path, messages=facts.messages, lost=facts.lost)
            pending.reply(reply)

    def fail(self, error: Exception, facts: Facts) -> None:
        """Say that the log can't be written any more."""
        self._is_finishing = False
        self._log.end("error", str(error), facts)
        pending, self._closing = self._closing, None
        if pending is not None:
            pending.fail(LogFailed(f"the log can't be written: {error}"))
