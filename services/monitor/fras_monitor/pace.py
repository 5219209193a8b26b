"""When something is done: again and again, and behind what is more urgent."""

import os
import sys
import threading
from typing import Final

NICENESS: Final = 10


def give_way() -> None:
    """Have the calling thread wait where all processors are busy: a trial's ticks come first.

    The other threads of the process, which pass on a stop, and those made before, do not wait. Only
    Linux knows the priority of a single thread; elsewhere nothing changes.
    """
    if sys.platform == "linux":
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICENESS)


class Due:
    """Something to do every `period_s`; what was missed is left out, not made up for."""

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._next_s = 0.0

    def take(self, now_s: float) -> bool:
        """Whether it is due; it is then not, for a period."""
        if now_s < self._next_s:
            return False
        self._next_s = now_s + self._period_s
        return True

    def wait_s(self, now_s: float) -> float:
        """Seconds until it is due."""
        return max(0.0, self._next_s - now_s)
