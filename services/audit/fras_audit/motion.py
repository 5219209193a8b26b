"""Motion again: each robot state, each result, each goal accepted or refused."""

from collections import Counter, deque
from collections.abc import Callable

from fras_audit.builds import rounding
from fras_audit.comparison import Tally, unstamped
from fras_audit.holds import audit_holds
from fras_audit.playback import playback_drivers
from fras_audit.progress import Progress
from fras_audit.recorded import Recorded, reply_of, request_of
from fras_audit.ticks import first_of_tick
from fras_common.errors import FrasError
from fras_common.messages import (
    ActionResult,
    ExecuteReply,
    ExecuteRequest,
    RobotState,
    RpcRecord,
)
from fras_common.topics import (
    ACTION_RESULT,
    CANCEL,
    EXECUTE,
    MOTION_RESET,
    ROBOT_STATE,
    VERDICT,
)
from fras_motion import states as core
from fras_motion.adapter import (
    action_result,
    goal_of,
    in_words,
    parameters_of,
    robot_state,
    verdict_of,
)
from fras_motion.errors import Refused
from fras_motion.holds import Holds
from fras_motion.trial import CANCELLER, MotionTrial

BUSY = "busy"
# Ends that a clock or a client decided, which no verdict leads to.
_BY_OTHERS = {"cancelled", "reset", "hold:sim", "hold:sa"}


class _Lost(Exception):
    """The log does not hold what motion went on with."""


def audit(recorded: Recorded, progress: Progress) -> list[Tally]:
    """Derive what motion said, state by state.

    Holds come from outside and at any time. Motion says the state anew before it ticks on with
    other holds, so the state that first shows one stands where it took effect.

    Returns
    -------
    list of Tally
        Robot states, results, goals, holds.
    """
    return [*_Audit(recorded).run(progress), audit_holds(recorded)]


class _Audit:
    def __init__(self, recorded: Recorded) -> None:
        tolerance = rounding(recorded, "motion")
        self._recorded = recorded
        self._said = recorded.of(ROBOT_STATE)
        self._ends = {one.goal_id: one for one in recorded.of(ACTION_RESULT)}
        self._verdicts = first_of_tick(recorded.of(VERDICT))
        asked = [one for one in recorded.mirrors(EXECUTE) if one.fault is None]
        self._asked: deque[RpcRecord] = deque(asked)
        self._states = Tally("motion", "robot states", len(self._said), tolerance)
        self._results = Tally("motion", "results", len(recorded.of(ACTION_RESULT)), tolerance)
        self._goals = Tally("motion", "goals", len(asked))
        self._latest_goal = ""
        self._holds = Holds()

    def run(self, progress: Progress) -> list[Tally]:
        tallies = [self._states, self._results, self._goals]
        reset = self._recorded.reset(MOTION_RESET)
        if reset is None or not self._said:
            what = ROBOT_STATE.key if reset is not None else "the reset of motion"
            self._states.notes.append(f"nothing derived: the log lacks {what}")
            return tallies
        if self._said[0].tick != 0:
            self._states.notes.append("nothing derived: the log lacks robot/state of tick 0")
            return tallies
        self._drivers = None
        if self._recorded.arms_by != "motion":
            self._drivers = playback_drivers(self._said[0])
            self._states.notes.append(
                f"the arms are driven by {self._recorded.arms_by}: what they measured is taken "
                "as recorded, what was sent to them is derived"
            )
        parameters = parameters_of(reset.scenario)
        trial = MotionTrial(self._recorded.trial, parameters, self._holds, Counter(), self._drivers)
        try:
            for number, said in enumerate(self._said, start=1):
                self._go_on(trial, said)
                progress("motion", number, len(self._said))
            self._flush(trial)
        except _Lost as lost:
            self._states.notes.append(str(lost))
        return tallies

    def _go_on(self, trial: MotionTrial, said: RobotState) -> None:
        if said.source != self._said[0].source:
            raise _Lost(f"not derived from tick {said.tick} on: another motion had taken over")
        self._end_by_others(trial, before_ns=said.stamp_ns)
        action = said.action
        if action is not None and action.goal_id != self._latest_goal:
            self._start(trial, action.goal_id)
        self._impose(trial, said)
        if said.tick == trial.tick + 1:
            self._tick(trial, said)
        elif said.tick != trial.tick:
            raise _Lost(f"not derived from tick {trial.tick + 1} on: no robot/state of it")
        snapshot = trial.controller.snapshot
        derived = robot_state(snapshot, trial.name, _operating_state(said))
        self._states.compare_messages(f"tick {said.tick}", said, derived)

    def _tick(self, trial: MotionTrial, said: RobotState) -> None:
        verdict = self._verdicts.get(trial.tick)
        if verdict is None:
            raise _Lost(f"not derived from tick {said.tick} on: no verdict on tick {trial.tick}")
        if self._drivers is not None:
            end = self._ends.get(self._latest_goal)
            fault = end is not None and (end.tick, end.reason) == (said.tick, "hold:arms")
            for driver in self._drivers.values():
                driver.load(said, fault)
        try:
            advance = trial.advance(verdict_of(verdict))
        except FrasError as error:
            self._states.surplus(f"tick {said.tick}", f"a tick; none was due: {error}", said.seq)
            raise _Lost(f"not derived after tick {trial.tick}") from error
        if advance.result is not None:
            self._finish(trial, advance.result)

    # --- goals ------------------------------------------------------------------------------

    def _start(self, trial: MotionTrial, goal_id: str) -> None:
        """Put the recorded goals to motion, up to the one that a state shows."""
        while self._latest_goal != goal_id:
            if not self._asked:
                raise _Lost(f"not derived from goal {goal_id} on: the log lacks its request")
            self._ask_next(trial)

    def _ask_next(self, trial: MotionTrial) -> None:
        if trial.goal is not None:
            # Motion takes one goal at a time, so the one before has ended without a tick.
            self._end_by_others(trial)
        mirror = self._asked.popleft()
        request, reply = request_of(EXECUTE, mirror), reply_of(EXECUTE, mirror)
        if reply.reason == "another_trial" and self._recorded.mirrors(CANCEL):
            trial.cancel("as recorded")
        self._put(trial, mirror, request, reply)
        if reply.accepted:
            self._latest_goal = request.goal_id
            while self._asked and reply_of(EXECUTE, self._asked[0]).reason == BUSY:
                late = self._asked.popleft()
                self._put(trial, late, request_of(EXECUTE, late), reply_of(EXECUTE, late))

    def _put(
        self, trial: MotionTrial, mirror: RpcRecord, request: ExecuteRequest, reply: ExecuteReply
    ) -> None:
        derived = ExecuteReply(accepted=True, reason="")
        try:
            trial.execute(request.trial, goal_of(request))
        except Refused as error:
            derived = ExecuteReply(
                accepted=False,
                reason=error.reason,
                text=str(error),
                values=in_words(error.values),
            )
        where = f"goal {request.goal_id}, {request.name} of {request.arm}"
        if not self._goals.compare(where, reply, derived, mirror.seq):
            raise _Lost(f"not derived from goal {request.goal_id} on: it was answered otherwise")

    # --- ends -------------------------------------------------------------------------------

    def _finish(self, trial: MotionTrial, result: core.ActionResult) -> None:
        goal, trial.goal = trial.goal, None
        if goal is None:
            return
        derived = action_result(result, goal, trial.name)
        end = self._ends.pop(goal.goal_id, None)
        if end is not None:
            self._results.compare_messages(f"result of {goal.goal_id}", end, derived)
        elif not self._recorded.damage:
            self._results.lacks(f"result of {goal.goal_id}", unstamped(derived))

    def _end_by_others(self, trial: MotionTrial, before_ns: int | None = None) -> None:
        """End the action under way where it was ended by a clock or a client, not by a tick."""
        end = self._ends.get(trial.goal.goal_id) if trial.goal is not None else None
        if end is None or end.tick != trial.tick or not _ended_by_others(end):
            return
        if before_ns is not None and end.stamp_ns > before_ns:
            return
        if (result := trial.end(end.reason)) is not None:
            self._finish(trial, result)

    def _flush(self, trial: MotionTrial) -> None:
        """Put what came after the last state."""
        self._end_by_others(trial)
        while self._asked and trial.goal is None:
            self._ask_next(trial)
            self._end_by_others(trial)

    # --- holds ------------------------------------------------------------------------------

    def _impose(self, trial: MotionTrial, said: RobotState) -> None:
        """Hold as the state shows."""
        wanted = {who: why for who, why in said.holds.items() if who != CANCELLER}
        for holder, reason in wanted.items():
            self._holds.hold(holder, reason)
        for holder in self._holds.current().keys() - wanted.keys():
            self._holds.resume(holder, by=holder)
        trial.impose_holds()
        if CANCELLER in said.holds and CANCELLER not in trial.controller.snapshot.holds:
            trial.cancel(said.holds[CANCELLER])


def _ended_by_others(end: ActionResult) -> bool:
    by_hold = end.reason.startswith("hold:") and end.reason.count(":") > 1
    return end.outcome == "aborted" and (end.reason in _BY_OTHERS or by_hold)


def _operating_state(said: RobotState) -> Callable[[str], str]:
    """Return how an arm's state by CRTK is told.

    Clients enable and disable arms, and a hold is told there before the loop has imposed it, so
    the recorded state stands, but for an arm that is held and said to be enabled.
    """
    held = said.holds.keys() - {CANCELLER}

    def told(arm: str) -> str:
        state = said.arms[arm].operating_state if arm in said.arms else "DISABLED"
        return "PAUSED" if held and state == "ENABLED" else state

    return told
