"""Situation awareness's shell: joins tissue and robot by tick, publishes a verdict on each."""

import time
from collections.abc import Callable

from fras_common import messages as m
from fras_common.codec import content_digest
from fras_common.scenario import Scenario, check
from fras_common.service import ServiceHost
from fras_common.service.recall import Recall
from fras_common.topics import (
    PATIENT,
    ROBOT_STATE,
    SA_RESET,
    TISSUE_MODEL,
    TISSUE_STATE,
    VERDICT,
)
from fras_sa.awareness import AwarenessError
from fras_sa.errors import NothingKnown
from fras_sa.questions import Questions
from fras_sa.resumption import TakenUp, take_up
from fras_sa.trial import WatchedTrial
from fras_sa.waiting import Waiting


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
        self._waiting = Waiting()
        self._verdict = host.publisher(VERDICT)
        host.subscribe(TISSUE_MODEL, self._on_model)
        host.subscribe(TISSUE_STATE, self._on_tissue)
        # Part of some stacks only; a trial that has one waits for it tick by tick.
        host.subscribe(PATIENT.state, self._on_patient, required=False)
        host.subscribe(ROBOT_STATE, self._on_robot)
        host.serve(SA_RESET, self._reset)
        self._recall = Recall(host, take_up(), self._take_up)
        self._questions = Questions(host, self._recall, lambda: self._trial)

    def _reset(self, request: m.ResetRequest) -> m.ResetReply:
        check(request.scenario)
        self._recall.give_up()
        # Asked again because an answer was lost: nothing has happened since that would be undone.
        if self._trial.tick > 0 or request != self._request:
            self._questions.fail(NothingKnown("another trial began"))
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

    def _on_model(self, model: m.TissueModel) -> None:
        try:
            self._trial.see_model(model)
        except AwarenessError as error:
            self._questions.fail(error)
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
        self._questions.look_again()

    def wake(self) -> float | None:
        """Say in health who has been waited for; ask what is to be taken up."""
        # A question about a tick of which nothing is here waits for motion to begin it.
        missing = self._trial.missing or ("motion" if self._questions.waiting else "")
        self._host.waiting_for = self._waiting.told(missing, self._clock())
        waits_s = (self._recall.wake(self._clock()), Waiting.period_s if missing else None)
        return min((wait_s for wait_s in waits_s if wait_s is not None), default=None)

    def close(self) -> None:
        """Nothing to put in order."""
