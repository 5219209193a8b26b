"""How often something may happen, and how often it is told: clocks are arguments."""

import threading
from collections import Counter
from typing import Final

from fras_common.errors import FrasError

PER_S: Final = 100.0
BURST: Final = 200
WAITING: Final = 64
"""Of each query: answered in a second on the long run, at once, and waiting for the loop.

A trial asks some ten questions a second at the most; a person, one. What a loop can do in a second
is left to the ticks."""

TOLD_AT_ONCE: Final = 10
TOLD_PER_S: Final = 1.0
SUBJECTS: Final = 256
OTHERS: Final = "others"


class TooManyQueries(FrasError):
    """A query that came too soon after too many others. Attributes: ``key``."""

    counted_as = "too_many_queries"

    def __init__(self, key: str) -> None:
        super().__init__(
            f"{key}: asked too often, at most {PER_S:g} times a second are answered and {WAITING} "
            "wait: ask again later, and more slowly",
            key=key,
        )


class Budget:
    """A token bucket; of any thread.

    Parameters
    ----------
    per_s : float
        How often on the long run.
    burst : int
        How often at once, after a rest.
    """

    def __init__(self, per_s: float = PER_S, burst: int = BURST) -> None:
        self._per_s = per_s
        self._burst = burst
        self._left = float(burst)
        self._then_s = float("-inf")
        self._lock = threading.Lock()

    def take(self, now_s: float) -> bool:
        """Whether it may happen now; if so, it has."""
        with self._lock:
            gained = (now_s - self._then_s) * self._per_s
            self._left = min(self._burst, self._left + max(0.0, gained))
            self._then_s = max(self._then_s, now_s)
            if self._left < 1.0:
                return False
            self._left -= 1.0
            return True


class Room:
    """Places for what waits; of any thread.

    Parameters
    ----------
    places : int
        How many.
    """

    def __init__(self, places: int) -> None:
        self._left = places
        self._lock = threading.Lock()

    def enter(self) -> bool:
        """Whether there is a place; if so, it is taken."""
        with self._lock:
            if self._left <= 0:
                return False
            self._left -= 1
            return True

    def leave(self) -> None:
        """Give a place back."""
        with self._lock:
            self._left += 1


class Admission:
    """Whether a query is taken: within its budget, and while few wait; of any thread."""

    def __init__(self) -> None:
        self._budget = Budget()
        self._room = Room(WAITING)

    def enter(self, now_s: float) -> bool:
        """Whether one more may wait; if so, it does."""
        if not self._room.enter():
            return False
        if not self._budget.take(now_s):
            self._room.leave()
            return False
        return True

    def leave(self) -> None:
        """Note that one waits no longer."""
        self._room.leave()


def and_more(untold: int) -> str:
    """Say how many were not told before."""
    return f" (and {untold} more, not told)" if untold else ""


class Telling:
    """Whether what happens again and again is told now: some at once, then once a second.

    Of each subject by itself; of the first some hundred, and of all others together.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._budgets: dict[str, Budget] = {}
        self._untold: Counter[str] = Counter()

    def due(self, subject: str, now_s: float) -> int | None:
        """None if it is not told now; else how many of the subject were not told before it."""
        with self._lock:
            if subject not in self._budgets and len(self._budgets) >= SUBJECTS:
                subject = OTHERS
            budget = self._budgets.setdefault(subject, Budget(TOLD_PER_S, TOLD_AT_ONCE))
            if budget.take(now_s):
                return self._untold.pop(subject, 0)
            self._untold[subject] += 1
            return None
