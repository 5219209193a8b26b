"""Motion again: each robot state, each result, each goal accepted or refused."""

from collections import Counter, deque
from collections.abc import Callable

import msgspec

from fras_audit.builds import rounding
from fras_audit.comparison import Tally, unstamped
from fras_audit.holds import audit_holds
from fras_audit.playback import playback_drivers
from fras_audit.progress import Progress
from fras_audit.recorded import Recorded, reply_of, request_of
from fras_audit.supervision import audit_supervision
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
    TASK_STATUS,
    VERDICT,
)
from fras_motion import states as core
from fras_motion.adapter import (
    action_result,
    goal_of,
    in_words,
    parameters_of,
    robot_state,
    snapshot_of,
    verdict_of,
)
from fras_motion.errors import Refused
from fras_motion.holds import RESTART, Holds
from fras_motion.resumption import interrupted
from fras_motion.trial import CANCELLER, MotionTrial

# Answered while a goal is under way, and so asked of the same state.
MEANWHILE = ("busy", "goal_used")
# Ends that a clock or a client decided, which no verdict leads to.
_BY_OTHERS = {"cancelled", "reset", "hold:sim", "hold:patient", "hold:sa"}


class _Lost(Exception):
    """The log does not hold what motion went on with."""


def audit(recorded: Recorded, progress: Progress) -> list[Tally]:
    """Derive what motion said, state by state.

    Holds come from outside and at any time. Motion says the state anew before it ticks on with
    other holds, so the state that first shows one stands where it took effect.

    Returns
    -------
    list of Tally
        Robot states, results, goals, holds, and in a supervised trial its supervision.
    """
    return [
        *_Audit(recorded).run(progress),
        audit_holds(recorded),
        *audit_supervision(recorded),
    ]


class _Audit:
    def __init__(self, recorded: Recorded) -> None:
        tolerance = rounding(recorded, "motion")
        self._recorded = recorded
        self._said = recorded.of(ROBOT_STATE)
        self._ends: dict[str, ActionResult] = {}
        self._verdicts = first_of_tick(recorded.of(VERDICT))
        asked = [one for one in recorded.mirrors(EXECUTE) if one.fault is None]
        self._asked: deque[RpcRecord] = deque(asked)
        self._states = Tally("motion", "robot states", len(self._said), tolerance)
        self._results = Tally("motion", "results", len(recorded.of(ACTION_RESULT)), tolerance)
        self._goals = Tally("motion", "goals", len(asked))
        self._latest_goal = ""
        self._put_before: set[str] = set()
        self._accepted: ExecuteRequest | None = None
        self._holds = Holds()
        for one in recorded.of(ACTION_RESULT):
            first = self._ends.setdefault(one.goal_id, one)
            if first is not one:
                # A motion that starts again says the last one again.
                self._results.compare_messages(f"result of {one.goal_id} again", one, first)

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
        self._parameters = parameters_of(reset.scenario)
        trial = self._new_trial()
        before = self._said[0]
        try:
            for number, said in enumerate(self._said, start=1):
                if said.source != before.source:
                    trial = self._take_over(trial, before, said)
                self._go_on(trial, said)
                before = said
                progress("motion", number, len(self._said))
            self._flush(trial)
        except _Lost as lost:
            self._states.notes.append(str(lost))
        return tallies

    def _new_trial(self) -> MotionTrial:
        name, parameters = self._recorded.trial, self._parameters
        return MotionTrial(name, parameters, self._holds, Counter(), self._drivers)

    def _take_over(self, trial: MotionTrial, before: RobotState, said: RobotState) -> MotionTrial:
        """Let another motion stand where the one before it stood, and end what that one did."""
        self._states.notes.append(f"another motion took over at tick {said.tick}: {said.source}")
        while self._asked and self._asked[0].source == before.source:
            self._ask_next(trial)
        self._holds.hold(RESTART, said.holds.get(RESTART, ""))
        after = self._new_trial()
        after.resume(snapshot_of(before), self._put_before)
        for goal_id, end in list(self._ends.items()):
            if end.source == said.source and end.reason == RESTART:
                self._compare_interrupted(end, before.tick)
                del self._ends[goal_id]
        return after

    def _compare_interrupted(self, end: ActionResult, tick: int) -> None:
        """Compare how the action ended that was under way, as the executive had told it."""
        where = f"result of {end.goal_id}"
        statuses = [one for one in self._recorded.of(TASK_STATUS) if one.goal_id == end.goal_id]
        derived = interrupted(statuses[0], "interrupted", RESTART, tick) if statuses else None
        if derived is not None:
            self._results.compare_messages(where, end, derived)
        else:
            self._results.surplus(where, "a result; no action was under way", end.seq)

    def _go_on(self, trial: MotionTrial, said: RobotState) -> None:
        self._end_by_others(trial, before_ns=said.stamp_ns)
        # Told before this state: it was put while the holds of the state before stood.
        while self._asked and self._asked[0].stamp_ns < said.stamp_ns and trial.goal is None:
            self._ask_next(trial)
        action = said.action
        if action is not None and action.goal_id not in self._put_before:
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
        while goal_id not in self._put_before:
            if not self._asked:
                raise _Lost(f"not derived from goal {goal_id} on: the log lacks its request")
            self._ask_next(trial)

    def _ask_next(self, trial: MotionTrial) -> None:
        if trial.goal is not None:
            # Motion takes one goal at a time, so the one before has ended without a tick.
            self._end_by_others(trial)
        mirror = self._asked.popleft()
        request, reply = request_of(EXECUTE, mirror), reply_of(EXECUTE, mirror)
        if request == self._accepted:
            # Asked again because the answer was lost.
            answer = ExecuteReply(accepted=True, reason="")
            self._goals.compare(f"goal {request.goal_id} again", reply, answer, mirror.seq)
            return
        if reply.reason != RESTART and RESTART in self._holds.current():
            # Lifted meanwhile; the next state shows it.
            self._holds.resume(RESTART, by=RESTART)
        if reply.reason == "another_trial" and self._recorded.mirrors(CANCEL):
            trial.cancel("as recorded")
        self._put(trial, mirror, request, reply)
        if reply.accepted:
            self._latest_goal, self._accepted = request.goal_id, request
            self._put_before.add(request.goal_id)
            while self._asked and reply_of(EXECUTE, self._asked[0]).reason in MEANWHILE:
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
            if end.reason == derived.reason == "hold:arms":
                # What an arm did wrong in its own words was measured, and can't be derived.
                derived = msgspec.structs.replace(derived, text=end.text, values=end.values)
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
