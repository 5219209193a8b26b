"""When something is done: again and again, and behind what is more urgent."""

import os
import sys
import threading
from typing import Final

NICENESS: Final = 10
FRAME_S: Final = 0.05
FAST: Final = 1.5
"""Simulated seconds in one of ours from which on a trial counts as run faster than life."""
MOST_S: Final = 0.5
"""Between two pictures, whatever one takes: who looks, and what was stopped, is told with them."""
GLANCE_S: Final = 0.02
"""A tick or two of such a trial."""
SHARE: Final = 0.02
"""Of one processor: what drawing such a trial may take."""


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


class Frames:
    """When the next picture is due: 20 a second, fewer of a trial that runs faster than life.

    Notes
    -----
    Such a trial is waited for rather than followed, and takes all that the machine has: there
    drawing keeps to its share, and ticks come first. At the pace of life processors idle between
    two ticks, and each picture is drawn.

    Attributes
    ----------
    fast : bool
        Whether the trial ran faster than life between the last two pictures.
    """

    def __init__(self) -> None:
        self._next_s = self._drawn_s = 0.0
        self._simulated_s = 0.0
        self.fast = False

    def wait_s(self, now_s: float) -> float:
        """Seconds until it is due."""
        return max(0.0, self._next_s - now_s)

    def drawn(self, now_s: float, took_s: float, simulated_s: float) -> None:
        """Note a picture.

        Parameters
        ----------
        now_s : float
            When it was begun.
        took_s : float
            Processor time that it took.
        simulated_s : float
            Up to where the trial had come.
        """
        since_s, went_s = now_s - self._drawn_s, simulated_s - self._simulated_s
        self.fast = went_s > FAST * since_s
        period_s = max(FRAME_S, min(took_s / SHARE, MOST_S)) if self.fast else FRAME_S
        self._drawn_s, self._simulated_s = now_s, simulated_s
        self._next_s = now_s + period_s

    def glance(self, now_s: float) -> float:
        """Have the next picture wait a little for something to draw; return for how long [s]."""
        self._next_s = now_s + GLANCE_S
        return GLANCE_S
