"""Motion's shell: one tick for each verdict, holds at any time, and the trial's only wall clock."""

import time

from fras_common.codec import content_digest
from fras_common.messages import (
    ExecuteReply,
    ExecuteRequest,
    HoldRequest,
    HoldState,
    ResetReply,
    ResetRequest,
    ResumeRequest,
    Verdict,
)
from fras_common.scenario import Scenario
from fras_common.service import ServiceHost
from fras_common.topics import (
    ACTION_RESULT,
    EXECUTE,
    HOLD,
    MOTION_RESET,
    RESUME,
    ROBOT_STATE,
    VERDICT,
)
from fras_motion.adapter import action_result, goal_of, parameters_of, robot_state, verdict_of
from fras_motion.controller import MotionController
from fras_motion.errors import Refused
from fras_motion.holds import Holds
from fras_motion.pacing import Pacer
from fras_motion.patience import Patience
from fras_motion.peers import Peers
from fras_motion.states import ActionResult, Goal


class MotionService:
    """Turns accepted actions into ticks, one verdict at a time."""

    def __init__(self, host: ServiceHost) -> None:
        self._host = host
        self._holds = Holds()
        self._controller: MotionController | None = None
        self._verdict: Verdict | None = None
        self._goal: Goal | None = None
        self._peers = Peers(host)
        self._begin(Scenario())
        self._state = host.publisher(ROBOT_STATE)
        self._result = host.publisher(ACTION_RESULT)
        host.subscribe(VERDICT, self._on_verdict)
        host.serve(MOTION_RESET, self._reset)
        host.serve(EXECUTE, self._execute)
        host.serve_at_once(HOLD, self._hold)
        host.serve_at_once(RESUME, self._resume)

    def _begin(self, scenario: Scenario) -> None:
        self._pacer = Pacer(scenario.tissue.dt_s, scenario.run.pace)
        self._patience = Patience(scenario.run.peer_timeout_s, scenario.run.hold_timeout_s)

    def _reset(self, request: ResetRequest) -> ResetReply:
        controller = MotionController(parameters_of(request.scenario))
        self._begin(request.scenario)
        self._controller = controller
        self._verdict = None
        self._goal = None
        self._holds.impose(controller)
        self._host.enter_trial(request.trial)
        self._publish(controller)
        return ResetReply(digest=content_digest(request.trial, request.scenario, request.mesh))

    def _execute(self, request: ExecuteRequest) -> ExecuteReply:
        controller = self._controller
        if controller is None or request.trial != self._host.gate.trial:
            return ExecuteReply(accepted=False, reason="another_trial")
        goal = goal_of(request)
        try:
            controller.execute(goal)
        except Refused as error:
            self._host.log.warning("goal refused", goal=request.goal_id, problem=str(error))
            return ExecuteReply(accepted=False, reason=error.reason)
        self._goal = goal
        return ExecuteReply(accepted=True, reason="")

    def _hold(self, request: HoldRequest) -> HoldState:
        # On the receiving thread: the stop must not wait behind anything.
        holds = self._holds.hold(request.holder, request.reason)
        self._host.post(lambda: self._host.log.info("held", by=request.holder))
        return HoldState(holds=holds, tick=self._host.tick)

    def _resume(self, request: ResumeRequest) -> HoldState:
        holds = self._holds.resume(request.holder, request.by)
        self._host.post(lambda: self._host.log.info("hold lifted", of=request.holder))
        return HoldState(holds=holds, tick=self._host.tick)

    def _on_verdict(self, verdict: Verdict) -> None:
        self._verdict = verdict

    def wake(self) -> float | None:
        """Do the next tick if it is due; else see whether something has been missing too long."""
        controller, now_s = self._controller, time.monotonic()
        if controller is None:
            return None
        self._holds.impose(controller)
        self._host.facts["holds"] = self._holds.in_words()
        tick, verdict = controller.snapshot.tick, self._verdict
        if controller.wants_tick and verdict is not None and verdict.tick == tick:
            self._host.waiting_for = ""
            self._patience.rest()
            wait_s = self._pacer.wait_s(now_s)
            if wait_s > 0.0:
                return wait_s
            self._advance(controller, verdict, now_s)
            return self._patience.period_s
        if self._goal is None:
            self._patience.rest()
            return None
        missing = self._peers.missing(tick) if controller.wants_tick else ""
        reason = self._patience.exhausted(now_s, missing, self._holds)
        self._host.waiting_for = self._patience.waiting_for
        if reason:
            self._finish(controller.abort(reason))
        return self._patience.period_s

    def _advance(self, controller: MotionController, verdict: Verdict, now_s: float) -> None:
        advance = controller.advance(verdict_of(verdict))
        self._pacer.ticked(now_s)
        self._publish(controller)
        self._finish(advance.result)

    def _publish(self, controller: MotionController) -> None:
        snapshot = controller.snapshot
        self._host.tick = snapshot.tick
        self._state.put(robot_state(snapshot, self._host.gate.trial))

    def _finish(self, result: ActionResult | None) -> None:
        goal = self._goal
        if result is not None and goal is not None:
            self._goal = None
            self._host.waiting_for = ""
            self._result.put(action_result(result, goal, self._host.gate.trial))

    def close(self) -> None:
        """Nothing to put in order: the arms stand at their last setpoint."""
