"""Situation awareness's shell: joins tissue and robot by tick, publishes a verdict on each."""

import time
from collections.abc import Callable

from fras_common import messages as m
from fras_common.codec import content_digest
from fras_common.errors import FrasError
from fras_common.scenario import Scenario, check
from fras_common.service import Deferred, ServiceHost
from fras_common.service.recall import Recall
from fras_common.topics import (
    CONTEXT,
    PATIENT,
    ROBOT_STATE,
    SA_CONTEXT,
    SA_RESET,
    SA_TARGET,
    TISSUE_MODEL,
    TISSUE_STATE,
    VERDICT,
)
from fras_sa.awareness import AwarenessError
from fras_sa.errors import NothingKnown, OtherTrial, TooManyQuestions
from fras_sa.resumption import TakenUp, take_up
from fras_sa.trial import WatchedTrial
from fras_sa.waiting import Waiting

# Each is looked at again with each verdict.
QUESTIONS = 100


class AwarenessService:
    """Judges each tick; answers for context and targets.

    Parameters
    ----------
    host : ServiceHost
    clock : callable
        Returns monotonic seconds; only to tell in health who has been waited for.
    """

    def __init__(self, host: ServiceHost, clock: Callable[[], float] = time.monotonic) -> None:
        self._host = host
        self._clock = clock
        self._trial = WatchedTrial(Scenario())
        self._request: m.ResetRequest | None = None
        self._pending: list[Deferred[m.ContextRequest, m.Context]] = []
        self._waiting = Waiting()
        self._verdict = host.publisher(VERDICT)
        self._context = host.publisher(CONTEXT)
        host.subscribe(TISSUE_MODEL, self._on_model)
        host.subscribe(TISSUE_STATE, self._on_tissue)
        # Part of some stacks only; a trial that has one waits for it tick by tick.
        host.subscribe(PATIENT.state, self._on_patient, required=False)
        host.subscribe(ROBOT_STATE, self._on_robot)
        host.serve(SA_RESET, self._reset)
        host.serve_deferred(SA_TARGET, self._on_target_request)
        host.serve_deferred(SA_CONTEXT, self._on_context_request)
        self._recall = Recall(host, take_up(), self._take_up)

    def _reset(self, request: m.ResetRequest) -> m.ResetReply:
        check(request.scenario)
        self._recall.give_up()
        # Asked again because an answer was lost: nothing has happened since that would be undone.
        if self._trial.tick > 0 or request != self._request:
            self._fail_pending(NothingKnown("another trial began"))
            self._trial = WatchedTrial(request.scenario)
            self._request = request
            self._host.enter_trial(request.trial)
        return m.ResetReply(digest=content_digest(request.trial, request.scenario, request.mesh))

    def _take_up(self, taken: TakenUp | None) -> None:
        if taken is None:
            return
        self._trial, self._request = taken.trial, taken.asked.request
        # This process speaks for what the one before it was told.
        self._host.publish_mirror(SA_RESET, taken.asked.record)
        for verdict in taken.verdicts:
            self._verdict.put(verdict)
        name = taken.asked.request.trial
        self._host.log.warning("trial taken up", trial=name, tick=taken.trial.tick)
        self._host.enter_trial(name)
        self._host.tick = taken.trial.tick

    def _fail_pending(self, error: FrasError) -> None:
        waiting, self._pending = self._pending, []
        for pending in waiting:
            pending.fail(error)

    def _on_model(self, model: m.TissueModel) -> None:
        try:
            self._trial.see_model(model)
        except AwarenessError as error:
            self._fail_pending(error)
            raise
        self._judge_next()

    def _on_tissue(self, state: m.TissueState) -> None:
        self._trial.see_state(state)
        self._judge_next()

    def _on_patient(self, state: m.TissueState) -> None:
        self._trial.see_patient(state)
        self._judge_next()

    def _on_robot(self, state: m.RobotState) -> None:
        said = self._trial.verdict
        if said is not None and said.tick == state.tick:
            # Asked again for the same tick: the same answer again.
            self._verdict.put(said)
            return
        self._trial.see_state(state)
        self._judge_next()

    def _judge_next(self) -> None:
        verdict = self._trial.judge_next()
        if verdict is None:
            return
        self._host.tick = verdict.tick
        self._verdict.put(verdict)
        if not verdict.ok:
            self._host.log.info(
                "verdict", tick=verdict.tick, level=verdict.level, force_n=verdict.max_force_n
            )
        waiting, self._pending = self._pending, []
        for pending in waiting:
            self._on_context_request(pending)

    def _on_context_request(self, pending: Deferred[m.ContextRequest, m.Context]) -> None:
        """Answer, or keep the question until its tick has been judged."""
        request, trial = pending.request, self._trial
        if self._is_early(request.trial, lambda: self._on_context_request(pending)):
            return
        try:
            self._require_trial(request.trial)
            if trial.problem is None and (trial.verdict is None or trial.tick < request.min_tick):
                if len(self._pending) >= QUESTIONS:
                    raise TooManyQuestions(len(self._pending), request.min_tick)
                self._pending.append(pending)
                return
            context = trial.context(request)
        except FrasError as error:
            pending.fail(error)
            return
        pending.reply(self._context.put(context))

    def _on_target_request(self, pending: Deferred[m.TargetRequest, m.TargetReply]) -> None:
        request = pending.request
        if self._is_early(request.trial, lambda: self._on_target_request(pending)):
            return
        try:
            self._require_trial(request.trial)
            reply = self._trial.target(request)
        except FrasError as error:
            pending.fail(error)
        else:
            pending.reply(reply)

    def _is_early(self, asked: str, again: Callable[[], None]) -> bool:
        """Whether a question comes before it is known which trial is under way: it is kept."""
        return asked != self._host.gate.trial and self._recall.keep(again)

    def _require_trial(self, asked: str) -> None:
        if asked != self._host.gate.trial:
            raise OtherTrial(asked, self._host.gate.trial)

    def wake(self) -> float | None:
        """Say in health who has been waited for; ask what is to be taken up."""
        # A question about a tick of which nothing is here waits for motion to begin it.
        missing = self._trial.missing or ("motion" if self._pending else "")
        self._host.waiting_for = self._waiting.told(missing, self._clock())
        waits_s = (self._recall.wake(self._clock()), Waiting.period_s if missing else None)
        return min((wait_s for wait_s in waits_s if wait_s is not None), default=None)

    def close(self) -> None:
        """Nothing to put in order."""
