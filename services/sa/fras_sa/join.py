"""Joining tissue and robot by tick: keys have no order among each other."""

from dataclasses import dataclass

from fras_common.messages import RobotState, TissueState
from fras_sa.errors import TooFarAhead

AHEAD = 1000
"""As many states as a publisher keeps for whoever comes late."""


@dataclass(frozen=True)
class Moment:
    """The states of one tick.

    Attributes
    ----------
    tissue : TissueState
        By the model: what the tissue bears.
    robot : RobotState
    seen : TissueState
        Of the patient, where there is one besides the model: where the tissue is.
    """

    tissue: TissueState
    robot: RobotState
    seen: TissueState


class TickJoin:
    """Hands out each tick once, in order, as soon as all of its states are there.

    Parameters
    ----------
    first : int
        The tick to begin with.
    has_patient : bool
        Whether a tick is complete only with the patient's state.
    """

    def __init__(self, first: int = 0, *, has_patient: bool = False) -> None:
        self._next = first
        self._has_patient = has_patient
        self._tissues: dict[int, TissueState] = {}
        self._robots: dict[int, RobotState] = {}
        self._seen: dict[int, TissueState] = {}

    def add(self, state: TissueState | RobotState) -> None:
        """Keep the first state of a tick until the tick is complete.

        One of a tick handed out already is dropped.

        Raises
        ------
        TooFarAhead
        """
        if not self._is_due(state):
            return
        if isinstance(state, TissueState):
            self._tissues.setdefault(state.tick, state)
        else:
            self._robots.setdefault(state.tick, state)

    def add_seen(self, state: TissueState) -> None:
        """Do the same with a state of the patient; one that is not waited for is dropped.

        Raises
        ------
        TooFarAhead
        """
        if self._has_patient and self._is_due(state):
            self._seen.setdefault(state.tick, state)

    def _is_due(self, state: TissueState | RobotState) -> bool:
        if state.tick >= self._next + AHEAD:
            raise TooFarAhead(state.tick, self._next)
        return state.tick >= self._next

    @property
    def is_empty(self) -> bool:
        """Whether no state waits for anything."""
        return not (self._tissues or self._robots or self._seen)

    @property
    def missing(self) -> str:
        """Whose state the next tick lacks, if anything of it or of a later one is here."""
        if self.is_empty:
            return ""
        if self._next not in self._robots:
            return "motion"
        if self._next not in self._tissues:
            return "sim"
        return "patient" if self._has_patient and self._next not in self._seen else ""

    def take(self) -> Moment | None:
        """Take the next tick, or None while it is incomplete."""
        tick = self._next
        if tick not in self._tissues or tick not in self._robots:
            return None
        if self._has_patient and tick not in self._seen:
            return None
        self._next += 1
        tissue = self._tissues.pop(tick)
        return Moment(tissue, self._robots.pop(tick), self._seen.pop(tick, tissue))
