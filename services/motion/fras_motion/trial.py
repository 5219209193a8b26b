"""One trial's worth of motion: its goals, taken until it is cancelled, and what holds the arms."""

from collections import Counter
from collections.abc import Collection, Mapping

from fras_motion.controller import MotionController
from fras_motion.drivers import Driver
from fras_motion.errors import Refused
from fras_motion.holds import CANCELLER, RESTART, Holds
from fras_motion.parameters import MotionParameters
from fras_motion.states import ActionResult, Advance, Goal, Snapshot, Verdict


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
        self._used: set[str] = set()
        _, self._holds_made, _ = holds.look()
        self.impose_holds()

    @property
    def runs(self) -> bool:
        """Whether it may still move the arms; nobody else does then."""
        return self._open or self.goal is not None

    @property
    def has_moved(self) -> bool:
        """Whether anything was done that a new beginning would undo."""
        return self.tick > 0 or self.goal is not None or not self._open

    @property
    def tick(self) -> int:
        """The tick at which the arms stand."""
        return self.controller.snapshot.tick

    def execute(self, trial: str, goal: Goal) -> None:
        """Begin an action.

        Raises
        ------
        Refused
            The goal is of another trial or of one that was cancelled, or was taken before, or
            motion can't do it.
        """
        if trial != self.name or not self._open:
            raise Refused("another_trial", f"{trial!r}; motion serves {self.name!r}", trial=trial)
        if RESTART in self._holds.current():
            text = f"motion started again at tick {self.tick}: lift the hold {RESTART!r} first"
            raise Refused("restart", text, tick=self.tick)
        self.require_new(goal)
        self.controller.execute(goal)
        self.goal = goal
        self._used.add(goal.goal_id)

    def require_new(self, goal: Goal) -> None:
        """Refuse a goal that was taken before: a request of then may be sent again at any time.

        Raises
        ------
        Refused
        """
        if goal.goal_id in self._used:
            text = f"{goal.goal_id!r} was taken before in this trial: a new goal has a new id"
            raise Refused("goal_used", text, goal_id=goal.goal_id)

    def resume(self, before: Snapshot, used: Collection[str] = ()) -> None:
        """Take the trial up where another process left it; raises as the controller does.

        Parameters
        ----------
        before : Snapshot
            The last that it told.
        used : collection of str
            Goals that it had taken.
        """
        self.controller.take_over(before)
        self._used.update(used)
        self.impose_holds()

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
