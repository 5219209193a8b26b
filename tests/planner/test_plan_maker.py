"""Planning from messages: what the scenario says reaches the core."""

from itertools import count

import msgspec
import pytest

from fras_common.messages import Context
from fras_common.scenario import PlannerSection, Scenario
from fras_planner.adapter import PlanMaker
from fras_planner.memory import PlanRequest
from fras_planner.planning import Knowledge, UnknownCriterion

CONTEXT = Context(
    trial="t",
    tick=3,
    request_id="c1",
    fluents=["reachable(psm1,b(1,1))", "reachable(psm1,b(1,2))", "above_roi(b(1,2))"],
    evidence={},
    names=["b(1,1)", "b(1,2)"],
    blocks_m=[(0.02, 0.02, 0.005), (0.02, 0.04, 0.005)],
    roi_m=(0.02, 0.04, 0.0),
    fixed_points_m=[],
    monitored=[],
)
REQUEST = PlanRequest(request_id="c1", reason="initial", ignore_ap=False, tried=())


@pytest.mark.parametrize(("limit_s", "core"), [(100.0, None), (1.0, ["search_time"])])
def test_a_plan_is_given_up_after_the_time_of_the_scenario(
    knowledge: Knowledge, limit_s: float, core: list[str] | None
) -> None:
    scenario = Scenario(planner=PlannerSection(time_limit_s=limit_s))
    plan = PlanMaker(knowledge, scenario, count(step=2.0).__next__)(CONTEXT, REQUEST)
    assert (plan.no_plan.core if plan.no_plan else None) == core
    assert bool(plan.actions) == (core is None)


def test_a_second_scene_of_a_trial_is_planned_anew(knowledge: Knowledge) -> None:
    """The rules that were parsed ahead are the first scene's."""
    maker = PlanMaker(knowledge, Scenario(), lambda: 0.0)
    first = maker(CONTEXT, REQUEST)
    fluents = [*CONTEXT.fluents[:2], "above_roi(b(1,1))"]
    moved = msgspec.structs.replace(CONTEXT, roi_m=(0.02, 0.02, 0.0), fluents=fluents)
    second = maker(moved, REQUEST)
    assert (first.target, second.target) == ("b(1,2)", "b(1,1)")
    assert maker(CONTEXT, REQUEST).explanation


def test_what_is_wrong_with_the_rules_is_told_by_the_first_plan(knowledge: Knowledge) -> None:
    files = {name: text for name, text in knowledge.files.items() if "capped" not in name}
    maker = PlanMaker(Knowledge(files, ""), Scenario(), lambda: 0.0)
    with pytest.raises(UnknownCriterion, match="capped"):
        maker(CONTEXT, REQUEST)
