"""Between messages and the planning core."""

from collections.abc import Callable

from fras_common import messages as m
from fras_common.scenario import Scenario
from fras_planner.executive import PlanRequest
from fras_planner.planning import Context, Knowledge, Plan, Planner, PlanningScene


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
        self._planner: Planner | None = None
        self._scene: PlanningScene | None = None

    def __call__(self, context: m.Context, request: PlanRequest) -> m.Plan:
        """Plan from a context.

        Raises
        ------
        PlanningError
            If the context says something that the signature does not know or that contradicts
            itself.
        """
        planner = self._planner_for(context)
        plan = planner.plan(context.fluents, ignore_ap=request.ignore_ap, tried=request.tried)
        return m.Plan(
            tick=context.tick,
            trial=context.trial,
            request_id=request.request_id,
            reason=request.reason,
            criterion=self._section.criterion,
            goal=self._section.goal,
            ignore_ap=request.ignore_ap,
            tried=list(request.tried),
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
                clock=self._clock,
            )
        return self._planner


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
