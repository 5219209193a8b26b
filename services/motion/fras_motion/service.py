"""Motion's shell: one tick for each verdict, holds at any time, and the trial's only wall clock."""

import time
from collections.abc import Mapping

from fras_common import messages as m
from fras_common.codec import content_digest
from fras_common.service import Deferred, ServiceHost
from fras_common.topics import (
    ACTION_RESULT,
    CANCEL,
    EXECUTE,
    HOLD,
    HOLDS,
    MOTION_RESET,
    RESUME,
    ROBOT_STATE,
    VERDICT,
)
from fras_motion.adapter import action_result, goal_of, parameters_of, robot_state, verdict_of
from fras_motion.arm_access import ArmAccess, remote_arms, simulated_arms
from fras_motion.errors import Refused
from fras_motion.holds import Holds
from fras_motion.log_watch import LogWatch
from fras_motion.pacing import Pacer
from fras_motion.patience import Patience
from fras_motion.peers import Peers
from fras_motion.refusals import refusal
from fras_motion.restoring import Restoring
from fras_motion.states import ActionResult
from fras_motion.trial import MotionTrial

SIMULATED = "simulated"
ARM_ACCESS = {SIMULATED: simulated_arms, "crtk": remote_arms}


class MotionService:
    """Turns accepted actions into ticks, one verdict at a time.

    Parameters
    ----------
    host : ServiceHost
    driver : str
        `simulated`, or `crtk` for arms that another process drives.
    """

    def __init__(self, host: ServiceHost, driver: str = SIMULATED) -> None:
        self._host = host
        self._said_holds = host.publisher(HOLDS)
        self._holds = Holds(lambda holds: self._say_holds(holds))
        self._trial: MotionTrial | None = None
        self._verdict: m.Verdict | None = None
        self._cancels: list[Deferred[m.CancelRequest, m.CancelReply]] = []
        self._pacer = Pacer(dt_s=0.0, pace=0.0)
        self._patience = Patience(peer_timeout_s=0.0, hold_timeout_s=0.0)
        self._peers = Peers(host)
        make_arms = ARM_ACCESS[driver]
        self._arms: ArmAccess = make_arms(host, self._holds)
        self._restoring = Restoring(host, self._restore_holds)
        self._log = LogWatch(host, self._holds)
        self._state = host.publisher(ROBOT_STATE)
        self._result = host.publisher(ACTION_RESULT)
        host.subscribe(VERDICT, self._on_verdict)
        host.serve(MOTION_RESET, self._reset)
        host.serve(EXECUTE, self._execute)
        host.serve_deferred(CANCEL, self._begin_cancel)
        host.serve_at_once(HOLD, self._hold)
        host.serve_at_once(RESUME, self._resume)

    def _reset(self, request: m.ResetRequest) -> m.ResetReply:
        scenario = request.scenario
        parameters = parameters_of(scenario)
        drivers = self._arms.drivers(parameters, scenario.run.pace)
        refusals = self._host.refusals
        trial = MotionTrial(request.trial, parameters, self._holds, refusals, drivers)
        if self._trial is not None:
            self._finish(self._trial, self._trial.end("reset"))
        self._trial = trial
        self._verdict = None
        self._pacer = Pacer(scenario.tissue.dt_s, scenario.run.pace)
        self._patience = Patience(scenario.run.peer_timeout_s, scenario.run.hold_timeout_s)
        self._log.begin(request.trial, required=scenario.run.require_log)
        self._host.enter_trial(request.trial)
        self._publish(trial)
        return m.ResetReply(digest=content_digest(request.trial, scenario, request.mesh))

    def _execute(self, request: m.ExecuteRequest) -> m.ExecuteReply:
        try:
            if self._trial is None:
                raise Refused("another_trial", f"{request.trial!r}; none has begun: reset first")
            self._trial.execute(request.trial, goal_of(request))
        except Refused as error:
            return refusal(self._host, request.goal_id, error)
        return m.ExecuteReply(accepted=True, reason="")

    def _begin_cancel(self, pending: Deferred[m.CancelRequest, m.CancelReply]) -> None:
        trial, request = self._trial, pending.request
        if trial is None or trial.name != request.trial:
            # Nothing of it moves the arms; what does is none of its business.
            pending.reply(m.CancelReply(tick=self._host.tick))
            return
        trial.cancel(request.reason)
        self._log.end()
        self._cancels.append(pending)

    def _hold(self, request: m.HoldRequest) -> m.HoldState:
        # On the receiving thread: the stop must not wait behind anything.
        holds = self._holds.hold_for_client(request.holder, request.reason)
        self._host.post(lambda: self._host.log.info("held", by=request.holder))
        return m.HoldState(holds=holds, tick=self._host.tick)

    def _say_holds(self, holds: dict[str, str]) -> None:
        # Before the answer to whoever changed them: what is acknowledged survives this process.
        self._said_holds.put(m.Holds(holds=holds))

    def _restore_holds(self, holds: Mapping[str, str]) -> None:
        self._holds.restore(holds)
        self._arms.restore(holds)

    def _resume(self, request: m.ResumeRequest) -> m.HoldState:
        holds = self._holds.resume_for_client(request.holder, request.by)
        self._host.post(lambda: self._host.log.info("hold lifted", of=request.holder))
        return m.HoldState(holds=holds, tick=self._host.tick)

    def _on_verdict(self, verdict: m.Verdict) -> None:
        if self._trial is not None:
            if verdict.tick == self._trial.controller.verdict_tick:
                # The arms were said again, with a new hold, and so were judged again.
                return
            self._trial.controller.expect(verdict.tick)
        self._verdict = verdict

    def wake(self) -> float | None:
        """Do the next tick if it is due; else see whether something has been missing too long."""
        self._log.wake()
        waits_s = (
            self._wake_trial(),
            self._arms.wake(self._trial, time.monotonic()),
            self._restoring.wake(time.monotonic()),
        )
        return min(wait_s for wait_s in waits_s if wait_s is not None)

    def _wake_trial(self) -> float | None:
        self._host.facts["holds"] = self._holds.in_words()
        trial, now_s = self._trial, time.monotonic()
        if trial is not None and trial.impose_holds():
            # No tick may follow that would show it.
            self._publish(trial)
        if trial is None or not trial.controller.wants_tick:
            self._end_cancels(trial)
        if trial is None:
            return None
        verdict = verdict_of(self._verdict) if self._verdict is not None else None
        if verdict is not None and trial.may_tick(verdict):
            self._host.waiting_for = ""
            self._patience.rest()
            if (wait_s := self._pacer.wait_s(now_s)) > 0.0:
                return wait_s
            advance = trial.advance(verdict)
            self._pacer.ticked(now_s)
            self._publish(trial)
            self._finish(trial, advance.result)
            return self._patience.period_s
        return self._wait(trial, now_s)

    def _wait(self, trial: MotionTrial, now_s: float) -> float | None:
        if trial.goal is None:
            self._patience.rest()
            return None
        missing = self._peers.missing(trial.tick) if trial.controller.wants_tick else ""
        reason = self._patience.exhausted(now_s, missing, self._holds)
        self._host.waiting_for = self._patience.waiting_for
        if reason:
            self._finish(trial, trial.end(reason, "watchdog" if missing else "hold_timeout"))
        elif self._host.waiting_for:
            # No verdict, no tick: the arms stand already.
            self._end_cancels(trial)
        return self._patience.period_s

    def _end_cancels(self, trial: MotionTrial | None) -> None:
        pending, self._cancels = self._cancels, []
        if pending and trial is not None:
            self._finish(trial, trial.end("cancelled"))
        for one in pending:
            one.reply(m.CancelReply(tick=self._host.tick))

    def _publish(self, trial: MotionTrial) -> None:
        self._host.tick = trial.tick
        self._state.put(
            robot_state(trial.controller.snapshot, trial.name, self._arms.operating_state)
        )

    def _finish(self, trial: MotionTrial, result: ActionResult | None) -> None:
        if result is not None and trial.goal is not None:
            goal, trial.goal = trial.goal, None
            self._host.waiting_for = ""
            self._result.put(action_result(result, goal, trial.name))

    def close(self) -> None:
        """Nothing to put in order: the arms stand at their last setpoint."""
