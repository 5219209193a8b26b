"""One trial's worth of motion: its goals, taken until it is cancelled, and what holds the arms."""

from collections import Counter
from collections.abc import Mapping

from fras_motion.controller import MotionController
from fras_motion.drivers import Driver
from fras_motion.errors import Refused
from fras_motion.holds import CANCELLER, Holds
from fras_motion.parameters import MotionParameters
from fras_motion.states import ActionResult, Advance, Goal, Verdict


class MotionTrial:
    """A controller, the goal under way, and whether more are taken.

    Parameters
    ----------
    name : str
        The trial's.
    parameters : MotionParameters
    holds : Holds
        What others hold; it outlives the trial.
    refusals : Counter
        Where what a safeguard refuses or stops is counted by its name.
    drivers : mapping of str to Driver, optional
        The robots; simulated ones by default.
    """

    def __init__(
        self,
        name: str,
        parameters: MotionParameters,
        holds: Holds,
        refusals: Counter[str],
        drivers: Mapping[str, Driver] | None = None,
    ) -> None:
        self.name = name
        self.controller = MotionController(parameters, drivers=drivers)
        self.goal: Goal | None = None
        self._holds = holds
        self._refusals = refusals
        self._open = True
        _, self._holds_made, _ = holds.look()
        self.impose_holds()

    @property
    def runs(self) -> bool:
        """Whether it may still move the arms; nobody else does then."""
        return self._open or self.goal is not None

    @property
    def tick(self) -> int:
        """The tick at which the arms stand."""
        return self.controller.snapshot.tick

    def execute(self, trial: str, goal: Goal) -> None:
        """Begin an action.

        Raises
        ------
        Refused
            The goal is of another trial or of one that was cancelled, or motion can't do it.
        """
        if trial != self.name or not self._open:
            raise Refused("another_trial", f"{trial!r}; motion serves {self.name!r}", trial=trial)
        self.controller.execute(goal)
        self.goal = goal

    def advance(self, verdict: Verdict) -> Advance:
        """Do one tick, and count what intervened in it."""
        advance = self.controller.advance(verdict)
        self._refusals.update(advance.interventions)
        return advance

    def may_tick(self, verdict: Verdict | None) -> bool:
        """Whether a tick is wanted and its verdict is there."""
        return self.controller.wants_tick and verdict is not None and verdict.tick == self.tick

    def cancel(self, reason: str) -> None:
        """Take no more goals, and bring the one under way to rest."""
        self._open = False
        self._refusals["cancel"] += 1
        if self.goal is not None:
            self.controller.hold(CANCELLER, reason)

    def end(self, reason: str, safeguard: str = "") -> ActionResult | None:
        """End the action under way at the tick where the arms stand; count what ends it."""
        if safeguard:
            self._refusals[safeguard] += 1
        result = self.controller.abort(reason)
        self.controller.resume(CANCELLER)
        return result

    def impose_holds(self) -> bool:
        """Make the controller's holds those in force; True if that changed anything.

        A hold that was lifted before it was seen here was acknowledged: it stops the action too.
        """
        wanted, made, last = self._holds.look()
        missed, self._holds_made = made > self._holds_made, made
        standing = {
            holder: reason
            for holder, reason in self.controller.snapshot.holds.items()
            if holder != CANCELLER
        }
        for holder, reason in wanted.items():
            if standing.get(holder) != reason:
                self._refusals["hold"] += 1
                self.controller.hold(holder, reason)
        for holder in standing.keys() - wanted.keys():
            self.controller.resume(holder)
        if missed and not wanted:
            self._refusals["hold"] += 1
            self.controller.hold(*last)
            self.controller.resume(last[0])
        return wanted != standing
