"""Motion's shell: one tick for each verdict, holds at any time, and the trial's only wall clock."""

import time
from collections.abc import Callable, Mapping

from fras_common import messages as m
from fras_common.codec import content_digest
from fras_common.errors import FrasError
from fras_common.scenario import check
from fras_common.service import Deferred, ServiceHost
from fras_common.service.recall import Recall
from fras_common.topics import (
    ACTION_RESULT,
    CANCEL,
    EXECUTE,
    MOTION_RESET,
    ROBOT_STATE,
    VERDICT,
)
from fras_motion.adapter import (
    action_result,
    goal_of,
    parameters_of,
    robot_state,
    snapshot_of,
    verdict_of,
)
from fras_motion.arm_access import ArmAccess, remote_arms, simulated_arms
from fras_motion.errors import Refused
from fras_motion.hold_desk import HoldDesk
from fras_motion.holds import RESTART
from fras_motion.log_watch import LogWatch
from fras_motion.pacing import Pacer
from fras_motion.page_watch import PageWatch
from fras_motion.patience import Patience
from fras_motion.peers import Peers
from fras_motion.refusals import refusal
from fras_motion.resumption import Left, TakenUp, given_up, recall_holds, take_up
from fras_motion.states import ActionResult
from fras_motion.trial import MotionTrial

SIMULATED = "simulated"
SAY_AGAIN_S = 0.5
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
        desk = HoldDesk(host)
        self._holds = desk.holds
        self._trial: MotionTrial | None = None
        self._verdict: m.Verdict | None = None
        self._cancels: list[Deferred[m.CancelRequest, m.CancelReply]] = []
        self._pacer = Pacer(dt_s=0.0, pace=0.0)
        self._patience = Patience(peer_timeout_s=0.0, hold_timeout_s=0.0)
        self._said_s = 0.0
        self._peers = Peers(host, self._say_again)
        self._request: m.ResetRequest | None = None
        self._accepted: m.ExecuteRequest | None = None
        make_arms = ARM_ACCESS[driver]
        self._arms: ArmAccess = make_arms(host, self._holds)
        self._recall_holds = Recall(host, recall_holds(), self._restore_holds, "holds")
        self._recall = Recall(host, take_up(), self._take_up)
        self._log = LogWatch(host, self._holds)
        self._page = PageWatch(host, self._holds)
        self._state = host.publisher(ROBOT_STATE)
        self._result = host.publisher(ACTION_RESULT)
        host.subscribe(VERDICT, self._on_verdict)
        host.serve(MOTION_RESET, self._reset)
        host.serve_deferred(EXECUTE, self._begin_execute)
        host.serve_deferred(CANCEL, self._begin_cancel)
        desk.open()

    def _reset(self, request: m.ResetRequest) -> m.ResetReply:
        check(request.scenario)
        self._forget_restart()
        self._recall.give_up()
        # Asked again because an answer was lost: nothing has moved since.
        if self._trial is None or self._trial.has_moved or request != self._request:
            trial = self._new_trial(request)
            if self._trial is not None:
                self._finish(self._trial, self._trial.end("reset"))
            self._enter(trial, request)
        else:
            self._publish(self._trial)
        return m.ResetReply(digest=content_digest(request.trial, request.scenario, request.mesh))

    def _new_trial(self, request: m.ResetRequest) -> MotionTrial:
        parameters = parameters_of(request.scenario)
        drivers = self._arms.drivers(parameters, request.scenario.run.pace)
        return MotionTrial(request.trial, parameters, self._holds, self._host.refusals, drivers)

    def _enter(self, trial: MotionTrial, request: m.ResetRequest) -> None:
        run = request.scenario.run
        self._trial, self._request = trial, request
        self._verdict, self._accepted = None, None
        self._pacer = Pacer(request.scenario.tissue.dt_s, run.pace)
        self._patience = Patience(run.peer_timeout_s, run.hold_timeout_s)
        self._log.begin(request.trial, required=run.require_log)
        self._page.begin(required=run.supervised)
        self._host.enter_trial(request.trial)
        self._publish(trial)

    def _restore_holds(self, holds: Mapping[str, str]) -> None:
        self._holds.restore(holds)
        self._arms.restore(holds)
        if holds:
            self._host.log.warning("holds restored", holds=holds)

    def _take_up(self, taken: TakenUp) -> None:
        """Stand where the trial under way was left, until resumed."""
        if taken.left is not None and self._trial is None:
            self._go_on(taken.left)
        if taken.problem:
            self._host.log.error("the trial under way can't be taken up", problem=taken.problem)
        if taken.lost is not None:
            self._result.put(taken.lost)

    def _go_on(self, left: Left) -> None:
        self._holds.hold(RESTART, f"motion started again at tick {left.state.tick}")
        try:
            trial = self._new_trial(left.asked.request)
            trial.resume(snapshot_of(left.state), left.used)
        except FrasError as error:
            self._forget_restart()
            self._host.log.error("the trial under way can't be taken up", problem=str(error))
            if left.result is not None:
                self._result.put(given_up(left.result))
            return
        self._enter(trial, left.asked.request)
        # This process speaks for what the one before it was told.
        self._host.publish_mirror(MOTION_RESET, left.asked.record)
        if left.result is not None:
            self._result.put(left.result)
        self._host.log.warning("trial taken up", trial=trial.name, tick=trial.tick)

    def _forget_restart(self) -> None:
        if RESTART in self._holds.current():
            self._holds.resume(RESTART, by=RESTART)

    def _say_again(self) -> None:
        """Say where the arms are: who came back may have missed it, and waits, too."""
        if self._trial is not None and self._trial.runs and self._trial.goal is None:
            self._publish(self._trial)

    def _is_early(self, again: Callable[[], None]) -> bool:
        """Whether it is not known yet which trial is under way: what asks of one is kept."""
        return self._trial is None and self._recall.keep(again)

    def _begin_execute(self, pending: Deferred[m.ExecuteRequest, m.ExecuteReply]) -> None:
        if self._is_early(lambda: self._begin_execute(pending)):
            return
        try:
            reply = self._execute(pending.request)
        except FrasError as error:
            pending.fail(error)
        else:
            pending.reply(reply)

    def _execute(self, request: m.ExecuteRequest) -> m.ExecuteReply:
        if request == self._accepted:
            # Asked again because the answer was lost: it runs, or has ended.
            return m.ExecuteReply(accepted=True, reason="")
        try:
            if self._trial is None:
                raise Refused("another_trial", f"{request.trial!r}; none has begun: reset first")
            self._trial.execute(request.trial, goal_of(request))
        except Refused as error:
            return refusal(self._host, request.goal_id, error)
        self._accepted = request
        return m.ExecuteReply(accepted=True, reason="")

    def _begin_cancel(self, pending: Deferred[m.CancelRequest, m.CancelReply]) -> None:
        if self._is_early(lambda: self._begin_cancel(pending)):
            return
        trial, request = self._trial, pending.request
        if trial is None or trial.name != request.trial:
            # Nothing of it moves the arms; what does is none of its business.
            pending.reply(m.CancelReply(tick=self._host.tick))
            return
        self._forget_restart()
        trial.cancel(request.reason)
        self._log.end()
        self._page.end()
        self._cancels.append(pending)

    def _on_verdict(self, verdict: m.Verdict) -> None:
        if self._trial is not None:
            if verdict.tick == self._trial.controller.verdict_tick:
                # The arms were said again, with a new hold, and so were judged again.
                return
            self._trial.controller.expect(verdict.tick)
        self._verdict = verdict

    def wake(self) -> float | None:
        """Do the next tick if it is due; else see whether something has been missing too long."""
        now_s = time.monotonic()
        waits_s = (
            self._log.wake(),
            self._page.wake(),
            self._wake_trial(),
            self._arms.wake(self._trial, now_s),
            (self._recall if self._recall_holds.is_done else self._recall_holds).wake(now_s),
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
        if missing and now_s - self._said_s >= SAY_AGAIN_S:
            # It, or the answer, may be lost with whoever was killed; the answer is the same.
            self._publish(trial)
        return self._patience.period_s

    def _end_cancels(self, trial: MotionTrial | None) -> None:
        pending, self._cancels = self._cancels, []
        if pending and trial is not None:
            self._finish(trial, trial.end("cancelled"))
        for one in pending:
            one.reply(m.CancelReply(tick=self._host.tick))

    def _publish(self, trial: MotionTrial) -> None:
        self._said_s = time.monotonic()
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
