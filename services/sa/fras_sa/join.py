"""Joining tissue and robot by tick: keys have no order among each other."""

from dataclasses import dataclass

from fras_common.messages import RobotState, TissueState
from fras_sa.errors import TooFarAhead

AHEAD = 1000
"""As many states as a publisher keeps for whoever comes late."""


@dataclass(frozen=True)
class Moment:
    """The two states of one tick."""

    tissue: TissueState
    robot: RobotState


class TickJoin:
    """Hands out each tick once, in order, as soon as both of its states are there.

    Parameters
    ----------
    first : int
        The tick to begin with.
    """

    def __init__(self, first: int = 0) -> None:
        self._next = first
        self._tissues: dict[int, TissueState] = {}
        self._robots: dict[int, RobotState] = {}

    def add(self, state: TissueState | RobotState) -> None:
        """Keep the first state of a tick until the tick is complete.

        One of a tick handed out already is dropped.

        Raises
        ------
        TooFarAhead
        """
        if state.tick < self._next:
            return
        if state.tick >= self._next + AHEAD:
            raise TooFarAhead(state.tick, self._next)
        if isinstance(state, TissueState):
            self._tissues.setdefault(state.tick, state)
        else:
            self._robots.setdefault(state.tick, state)

    @property
    def is_empty(self) -> bool:
        """Whether no state waits for anything."""
        return not (self._tissues or self._robots)

    @property
    def missing(self) -> str:
        """Whose state the next tick lacks, if anything of it or of a later one is here."""
        if self.is_empty:
            return ""
        if self._next not in self._robots:
            return "motion"
        return "" if self._next in self._tissues else "sim"

    def take(self) -> Moment | None:
        """Take the next tick, or None while it is incomplete."""
        tick = self._next
        if tick not in self._tissues or tick not in self._robots:
            return None
        self._next += 1
        return Moment(self._tissues.pop(tick), self._robots.pop(tick))
