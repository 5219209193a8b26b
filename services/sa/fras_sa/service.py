"""Situation awareness's shell: joins tissue and robot by tick, publishes a verdict on each."""

from fras_common import messages as m
from fras_common.codec import content_digest
from fras_common.errors import FrasError
from fras_common.scenario import Scenario
from fras_common.service import Deferred, ServiceHost
from fras_common.topics import (
    CONTEXT,
    ROBOT_STATE,
    SA_CONTEXT,
    SA_RESET,
    SA_TARGET,
    TISSUE_MODEL,
    TISSUE_STATE,
    VERDICT,
)
from fras_sa.adapter import (
    context_of,
    model_of,
    parameters_of,
    robot_of,
    tissue_of,
    verdict_of,
)
from fras_sa.awareness import Awareness, AwarenessError, Memory
from fras_sa.errors import NothingKnown, OtherTrial
from fras_sa.join import Moment, TickJoin


class AwarenessService:
    """Judges each tick; answers for context and targets."""

    def __init__(self, host: ServiceHost) -> None:
        self._host = host
        self._begin(Scenario())
        self._verdict = host.publisher(VERDICT)
        self._context = host.publisher(CONTEXT)
        host.subscribe(TISSUE_MODEL, self._on_model)
        host.subscribe(TISSUE_STATE, self._on_state)
        host.subscribe(ROBOT_STATE, self._on_state)
        host.serve(SA_RESET, self._reset)
        host.serve(SA_TARGET, self._target)
        host.serve_deferred(SA_CONTEXT, self._on_context_request)

    def _begin(self, scenario: Scenario) -> None:
        self._parameters = parameters_of(scenario.awareness)
        self._awareness: Awareness | None = None
        self._problem: AwarenessError | None = None
        self._memory = Memory()
        self._join = TickJoin()
        self._now: Moment | None = None
        self._pending: list[Deferred[m.ContextRequest, m.Context]] = []

    def _reset(self, request: m.ResetRequest) -> m.ResetReply:
        self._fail_pending(NothingKnown("another trial began"))
        self._begin(request.scenario)
        self._host.enter_trial(request.trial)
        return m.ResetReply(digest=content_digest(request.trial, request.scenario, request.mesh))

    def _fail_pending(self, error: FrasError) -> None:
        waiting, self._pending = self._pending, []
        for pending in waiting:
            pending.fail(error)

    def _on_model(self, model: m.TissueModel) -> None:
        try:
            self._awareness = Awareness(self._parameters, model_of(model))
        except AwarenessError as error:
            self._problem = error
            self._fail_pending(error)
            raise
        self._judge_next()

    def _on_state(self, state: m.TissueState | m.RobotState) -> None:
        self._join.add(state)
        self._judge_next()

    def _judge_next(self) -> None:
        """Judge the next tick as soon as both of its states and the model are here."""
        if self._awareness is None or (moment := self._join.take()) is None:
            return
        tick = moment.tissue.tick
        judgement = self._awareness.judge(
            tissue_of(moment.tissue), robot_of(moment.robot), self._memory
        )
        self._memory = judgement.memory
        self._now = moment
        self._host.tick = tick
        self._verdict.put(verdict_of(judgement, self._parameters, moment.tissue))
        if judgement.level != "ok":
            self._host.log.info(
                "verdict", tick=tick, level=judgement.level, force_n=judgement.force_n
            )
        waiting, self._pending = self._pending, []
        for pending in waiting:
            self._on_context_request(pending)

    def _on_context_request(self, pending: Deferred[m.ContextRequest, m.Context]) -> None:
        request = pending.request
        if request.trial != self._host.gate.trial:
            pending.fail(OtherTrial(request.trial, self._host.gate.trial))
            return
        if self._problem is not None:
            pending.fail(self._problem)
            return
        if self._now is None or self._now.tissue.tick < request.min_tick:
            self._pending.append(pending)
            return
        awareness, now = self._known()
        try:
            view = awareness.context(tissue_of(now.tissue), robot_of(now.robot), self._memory)
        except AwarenessError as error:
            pending.fail(error)
            return
        context = self._context.put(context_of(view, now.tissue, request.request_id))
        pending.reply(context)

    def _target(self, request: m.TargetRequest) -> m.TargetReply:
        if request.trial != self._host.gate.trial:
            raise OtherTrial(request.trial, self._host.gate.trial)
        awareness, now = self._known()
        target = awareness.target(
            tissue_of(now.tissue),
            robot_of(now.robot),
            action=request.action,
            arm=request.arm,
            block=request.block,
        )
        if target is None:
            return m.TargetReply(position_m=None)
        return m.TargetReply(position_m=(float(target[0]), float(target[1]), float(target[2])))

    def _known(self) -> tuple[Awareness, Moment]:
        if self._awareness is None or self._now is None:
            raise NothingKnown("no state of this trial has been seen yet: reset and tick first")
        return self._awareness, self._now

    def wake(self) -> float | None:
        """Nothing is due by time."""
        return None

    def close(self) -> None:
        """Nothing to put in order."""
