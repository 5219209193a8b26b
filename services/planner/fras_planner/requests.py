"""Requests of the executive that more than one answer fulfils."""

from collections.abc import Generator
from typing import Any

from fras_common.bus import RemoteFault
from fras_common.messages import (
    CancelReply,
    CancelRequest,
    CloseRequest,
    OpenRequest,
    ResumeRequest,
)
from fras_common.topics import CANCEL, RECORDER_CLOSE, RECORDER_OPEN, RESUME
from fras_planner.effects import Ask, Pause
from fras_planner.endings import RESTART

CLOSE_TIMEOUT_S = 15.0
# A recorder that starts again reads first what there is of the log.
REOPEN_TIMEOUT_S = 30.0
NOTHING_TO_CLOSE = "NothingToClose"
# A disk that is full as the trial ends may have room again: how long to wait before each try.
LOG_PAUSES_S = (0.5, 1.0, 2.0, 4.0, 8.0)
UNWRITABLE = (NOTHING_TO_CLOSE, "LogFailed", "LogUnwritable")
UNKNOWN_HOLD = "UnknownHold"

Asking = Generator[Ask | Pause, Any, Any]


def close_log(closing: CloseRequest, opening: OpenRequest) -> Asking:
    """Have the log closed; `opening` is what opened it. Raises as its questions fail.

    A recorder that has it open no more, since another took its place or its disk was full, is asked
    to take it up again, and that again and again for a while.
    """
    pauses_s = iter(LOG_PAUSES_S)
    is_open = True
    while True:
        try:
            if not is_open:
                yield Ask(RECORDER_OPEN, opening, REOPEN_TIMEOUT_S)
            yield Ask(RECORDER_CLOSE, closing, CLOSE_TIMEOUT_S)
        except RemoteFault as fault:
            if fault.remote_kind not in UNWRITABLE:
                raise
            if not is_open or fault.remote_kind != NOTHING_TO_CLOSE:
                pause_s = next(pauses_s, None)
                if pause_s is None:
                    raise
                yield Pause(pause_s, "recorder")
            is_open = False
        else:
            return


def leave_motion(trial: str, timeout_s: float, *, is_patient: bool) -> Asking:
    """Have motion forget the trial: no goal of it moves the arms any more. Returns the tick."""
    request = CancelRequest(trial=trial, reason="the trial has ended")
    reply: CancelReply = yield Ask(CANCEL, request, timeout_s, is_patient)
    return reply.tick


def lift_restart(timeout_s: float) -> Asking:
    """Let motion move again: what it was about to do is planned anew."""
    try:
        yield Ask(RESUME, ResumeRequest(holder=RESTART, by="executive"), timeout_s)
    except RemoteFault as error:
        # A person was faster.
        if error.remote_kind != UNKNOWN_HOLD:
            raise
