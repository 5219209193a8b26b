"""Between messages and the planning core."""

from collections.abc import Callable, Iterable, Mapping

from fras_common import messages as m
from fras_common.errors import FrasError
from fras_common.scenario import Scenario
from fras_planner.memory import PlanRequest
from fras_planner.planning import (
    Context,
    Knowledge,
    Parsed,
    Plan,
    Planner,
    PlanningError,
    PlanningScene,
    parse,
    verify,
)

NOTHING_PLANNED = "nothing has been planned yet: ask once a trial has its first plan"


class NothingPlanned(FrasError):
    """A question about a plan before there is one."""


class PlanMaker:
    """Plans for one trial; keeps one long-lived planner a scene.

    Parameters
    ----------
    knowledge : Knowledge
    scenario : Scenario
    clock : callable
        Returns seconds, for `ground_s` and `solve_s` only.
    """

    def __init__(
        self, knowledge: Knowledge, scenario: Scenario, clock: Callable[[], float]
    ) -> None:
        self._clock = clock
        self._knowledge = knowledge
        self._section = scenario.planner
        self._parsed = self._parse_ahead()
        self._planner: Planner | None = None
        self._scene: PlanningScene | None = None
        self._latest: tuple[m.Context, PlanRequest] | None = None

    def __call__(self, context: m.Context, request: PlanRequest) -> m.Plan:
        """Plan from a context.

        Raises
        ------
        PlanningError
            If the context says something that the signature does not know or that contradicts
            itself.
        """
        planner = self._planner_for(context)
        self._latest = context, request
        plan = planner.plan(
            context.fluents,
            ignore_ap=request.ignore_ap,
            tried=request.tried,
            rejected=request.rejected,
            reason=request.reason,
            evidence=context.evidence,
        )
        return m.Plan(
            tick=context.tick,
            trial=context.trial,
            request_id=request.request_id,
            reason=request.reason,
            criterion=self._section.criterion,
            goal=self._section.goal,
            asp_digest=self._knowledge.digest,
            ignore_ap=request.ignore_ap,
            tried=list(request.tried),
            rejected=list(request.rejected),
            actions=_actions(plan),
            target=plan.target,
            arm=plan.arm,
            history=[m.HistoryStep(t=t, atoms=list(atoms)) for t, atoms in plan.history.items()],
            cost=list(plan.cost),
            models=plan.models,
            ground_s=plan.ground_s,
            solve_s=plan.solve_s,
            explanation=list(plan.explanation),
            no_plan=m.NoPlan(core=list(plan.no_plan.core), sentences=list(plan.no_plan.sentences))
            if plan.no_plan is not None
            else None,
        )

    def recall(self, plan: m.Plan, context: m.Context) -> None:
        """Take what another planner decided last; raises as a call does."""
        self(context, PlanRequest.of(plan))

    def why_not(self, question: str) -> m.WhyNotReply:
        """Say why the latest plan is not another one.

        Raises
        ------
        NothingPlanned
            If there is no plan yet.
        PlanningError
            If the question is about something that there is not.
        """
        if self._planner is None or self._latest is None:
            raise NothingPlanned(NOTHING_PLANNED)
        context, request = self._latest
        answer = self._planner.why_not(
            question, context.fluents, request.ignore_ap, request.tried, request.rejected
        )
        return m.WhyNotReply(
            question=answer.question,
            trial=context.trial,
            request_id=context.request_id,
            rules=list(answer.rules),
            sentences=list(answer.sentences),
        )

    def _parse_ahead(self) -> Parsed | None:
        """Parse the rules before the scene is known, so that the first plan waits for less."""
        try:
            return parse(self._knowledge, self._section.criterion, self._section.goal)
        except PlanningError:
            # The first plan says so, where it is waited for.
            return None

    def _planner_for(self, context: m.Context) -> Planner:
        scene = PlanningScene.from_context(
            Context(
                names=tuple(context.names),
                blocks_m=tuple(context.blocks_m),
                roi_m=context.roi_m,
                fluents=tuple(context.fluents),
                fixed_points_m=tuple(context.fixed_points_m),
            ),
            self._knowledge,
        )
        if self._planner is None or scene != self._scene:
            self._scene = scene
            self._planner = Planner(
                self._knowledge,
                scene,
                criterion=self._section.criterion,
                goal=self._section.goal,
                time_limit_s=self._section.time_limit_s,
                clock=self._clock,
                parsed=self._parsed,
            )
            self._parsed = None
        return self._planner


def verified(knowledge: Knowledge, history: Mapping[int, Iterable[str]]) -> list[str]:
    """Say in words which safety specifications a history breaks."""
    try:
        return [violation.sentence for violation in verify(knowledge, history)]
    except PlanningError as error:
        return [f"the history could not be verified: {error}"]


def _actions(plan: Plan) -> list[m.PlannedAction]:
    return [
        m.PlannedAction(
            t=action.t,
            text=action.text,
            name=action.name,
            args=list(action.args),
            expected=list(action.expected),
        )
        for action in plan.actions
    ]
