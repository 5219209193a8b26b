"""A planner that has planned before gives what a fresh one gives, in any state."""

import gc
import weakref
from collections.abc import Callable

import numpy as np
import pytest

from fras_planner.planning import Knowledge, Plan, Planner, PlanningScene
from fras_planner.planning.program import Program
from support import campaign
from support.planning import random_state

SceneMaker = Callable[..., PlanningScene]
# In all: 2 criteria, 2 goals, 20 scenes each, so many random states in each of them.
SCENES, STATES = 20, campaign.length(25, 6)


def outcome(plan: Plan) -> tuple[object, ...]:
    story = plan.history, plan.explanation, plan.no_plan
    return plan.actions, plan.target, plan.arm, plan.cost, *story


@pytest.mark.parametrize("criterion", ["weighted", "lex"])
@pytest.mark.parametrize("goal", ["visible", "clear"])
def test_warm_equals_fresh(
    knowledge: Knowledge, make_scene: SceneMaker, criterion: str, goal: str
) -> None:
    rng = np.random.default_rng(7)
    kinds: set[str] = set()
    for seed in range(SCENES):
        scene = make_scene(3 + (seed % 10 == 0), seed)
        warm = Planner(knowledge, scene, criterion, goal)
        for _ in range(STATES):
            state = random_state(rng, scene.names)
            share = rng.choice([0.0, 0.3, 1.0])
            tried = [name for name in scene.names if rng.random() < share]
            ignore_ap = bool(rng.random() < 0.2)
            plan = warm.plan(state, ignore_ap, tried)
            fresh = Planner(knowledge, scene, criterion, goal).plan(state, ignore_ap, tried)
            assert outcome(plan) == outcome(fresh), (seed, state, tried, ignore_ap)
            kinds |= {action.name for action in plan.actions}
            kinds |= {"none"} if plan.no_plan else set()
    assert kinds == {"reach", "grasp", "pull", "move", "release", "none"}


def test_the_order_of_the_fluents_does_not_matter(
    knowledge: Knowledge, make_scene: SceneMaker
) -> None:
    scene = make_scene(5, 1)
    state = ["closed_gripper(psm1)", "at(psm1,b(2,2))", "in_hand(psm1,b(2,2))", *scene.statics]
    planner = Planner(knowledge, scene)
    there = planner.plan(sorted(state), tried=["b(2,2)", "b(3,3)"])
    back = planner.plan(sorted(state, reverse=True), tried=["b(3,3)", "b(2,2)"])
    assert outcome(there) == outcome(back)


def test_each_plan_leads_to_its_goal_by_its_own_history(
    knowledge: Knowledge, make_scene: SceneMaker
) -> None:
    rng = np.random.default_rng(11)
    scene = make_scene(4, 2)
    planner = Planner(knowledge, scene)
    for _ in range(100):
        plan = planner.plan(random_state(rng, scene.names))
        steps = len(plan.actions) + 1
        assert "visible_roi" in plan.history[steps]
        for action in plan.actions:
            assert action.text in plan.history[action.t]
            after = plan.history[action.t + 1]
            for atom in action.expected:
                assert (atom.lstrip("-") in after) != atom.startswith("-")


def test_a_planner_is_freed_when_it_is_let_go(knowledge: Knowledge, make_scene: SceneMaker) -> None:
    """By its last reference: what waits for the cycle collector costs memory and pauses."""
    gc.collect()
    gc.disable()
    try:
        planner = Planner(knowledge, make_scene(4, 1))
        planner.plan([])
        planner.why_not("b(1,1)", [])
        planner.plan([], tried=planner.scene.names)
        gone = weakref.ref(planner)
        del planner
        assert gone() is None
        programs = [one for one in gc.get_objects() if isinstance(one, Program)]
        assert programs == []
    finally:
        gc.enable()
