"""The trial gate: what belongs to another trial than the last reset's is dropped and counted."""

from collections import deque
from collections.abc import Callable
from typing import Any

from fras_common.messages import Header

HELD = 64


class TrialGate:
    """Admits messages of the current trial.

    Keys have no order among each other, so the first messages of a new trial may overtake the
    reset that names it. They are kept (the last `HELD`) and handed out by `enter`; everything
    else of another trial is dropped and counted.

    Parameters
    ----------
    on_drop : callable, optional
        Told the route and the message of each drop, and the trial that is served.
    """

    def __init__(self, on_drop: Callable[[Any, Header, str], None] | None = None) -> None:
        self.trial = ""
        self._on_drop = on_drop
        self.dropped = 0
        self._early: deque[tuple[Any, Header]] = deque()

    def admit(self, route: Any, message: Header) -> bool:
        """Whether `message` may be handled now; if not it is kept or dropped."""
        if message.trial == self.trial:
            return True
        self._early.append((route, message))
        if len(self._early) > HELD:
            self._drop(self._early.popleft())
        return False

    def enter(self, trial: str) -> list[tuple[Any, Header]]:
        """Begin `trial`; returns what arrived for it too early, in order of arrival."""
        self.trial = trial
        due = [entry for entry in self._early if entry[1].trial == trial]
        others = [entry for entry in self._early if entry[1].trial != trial]
        self._early.clear()
        for entry in others:
            self._drop(entry)
        return due

    def _drop(self, entry: tuple[Any, Header]) -> None:
        self.dropped += 1
        if self._on_drop is not None:
            self._on_drop(*entry, self.trial)
