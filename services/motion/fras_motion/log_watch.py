"""Nothing moves that is not recorded: motion's own hold while the log can't keep up or is away."""

import time
from collections.abc import Callable
from math import inf

from fras_common.messages import RecorderStatus
from fras_common.service import ServiceHost
from fras_common.topics import RECORDER_STATUS
from fras_motion.holds import LOG, Holds

__all__ = ["LogWatch"]

# Whoever comes back, the router among them, has to recover first what was said meanwhile: a message
# that is missed in these moments may stay missing.
SETTLE_S = 1.0
PERIOD_S = 0.25


class LogWatch:
    """Holds the arms of a trial that demands a log while that log is not being written.

    Parameters
    ----------
    host : ServiceHost
    holds : Holds
    clock : callable
        Returns monotonic seconds: for how long the recorder has been back.
    """

    def __init__(
        self, host: ServiceHost, holds: Holds, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._host = host
        self._holds = holds
        self._clock = clock
        self._away_s = -inf
        self._required_by = ""
        self._heard = False
        self._status = RecorderStatus(
            state="idle", path="", messages=0, bytes=0, lost=0, reason="", trial=""
        )
        host.subscribe(RECORDER_STATUS, self._on_status)

    def begin(self, trial: str, *, required: bool) -> None:
        """Watch the log of a trial from now on, if it demands one."""
        self._required_by = trial if required else ""
        # It was opened before motion was reset, but keys have no order among each other: until the
        # recorder's word on this trial has come, none of another is taken for it.
        self._heard = self._status.trial == trial

    def end(self) -> None:
        """Watch no more: the trial is over."""
        self._required_by = ""

    def _on_status(self, status: RecorderStatus) -> None:
        self._status = status
        self._heard = self._heard or status.trial == self._required_by

    def wake(self) -> float | None:
        """Hold, or lift the hold, as it stands now; seconds until it may be lifted, or None."""
        problem = self._problem() if self._required_by else ""
        held = self._holds.current().get(LOG)
        if problem and held is None:
            self._holds.hold(LOG, problem)
        elif not problem and held is not None:
            self._holds.resume(LOG, by=LOG)
        return PERIOD_S if problem else None

    def _problem(self) -> str:
        status = self._status
        if not self._heard:
            return ""
        if not self._host.present("alive/recorder"):
            self._away_s = self._clock()
        if self._clock() - self._away_s < SETTLE_S:
            return "the recorder is away"
        if status.trial != self._required_by or status.state != "recording":
            return f"the log is {status.state} {status.reason}".rstrip()
        return ""
