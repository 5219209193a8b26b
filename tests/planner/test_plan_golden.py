"""The paper's scenarios A, B and C, and what the rules of re-planning ask for, as whole plans."""

from collections.abc import Callable

import pytest

from fras_planner.planning import Knowledge, Plan, Planner, PlanningScene

SceneMaker = Callable[..., PlanningScene]


@pytest.fixture(scope="module")
def scene(make_scene: SceneMaker) -> PlanningScene:
    """7 x 7 blocks, attachments along the row i = 1; the best grasp is at (7, 3)."""
    made = make_scene(7, fixed=[f"b(1,{j})" for j in range(1, 8)])
    statics = [atom for atom in made.statics if not atom.startswith("above_roi")]
    return PlanningScene.make(
        made.names,
        made.blocks_m,
        (0.06, 0.045, 0.0),
        [
            *statics,
            "above_roi(b(5,3))",
        ],
    )


def texts(plan: Plan) -> list[str]:
    return [action.text for action in plan.actions]


def held(block: str, arm: str = "psm1") -> list[str]:
    return [f"at({arm},{block})", f"in_hand({arm},{block})", f"closed_gripper({arm})"]


def test_a_reach_grasp_pull(planner: Planner) -> None:
    plan = planner.plan([])
    # weighted, along the ROI's row j = 3: 2 * 71 - 19 at i = 6, 2 * 57 - 4 at 5, 2 * 86 - 33 at 7.
    assert texts(plan) == ["reach(psm1,b(7,3))", "grasp(psm1,b(7,3))", "pull(psm1,b(7,3))"]
    assert [action.t for action in plan.actions] == [1, 2, 3]
    assert plan.actions[0].name == "reach"
    assert plan.actions[0].args == ("psm1", "b(7,3)")
    assert (plan.target, plan.arm) == ("b(7,3)", "psm1")
    assert plan.optimal
    assert plan.models >= 1


def test_a_expects_what_must_be_sensed(planner: Planner) -> None:
    expected = [action.expected for action in planner.plan([]).actions]
    assert expected == [
        ("at(psm1,b(7,3))",),
        ("closed_gripper(psm1)", "in_hand(psm1,b(7,3))"),
        (),
    ]


def test_a_history_holds_every_atom_at_every_step(planner: Planner, scene: PlanningScene) -> None:
    history = planner.plan(["max_height(psm2)"]).history
    assert sorted(history) == [1, 2, 3, 4]
    changing = {t: set(atoms) - scene.statics for t, atoms in history.items()}
    holding = {"at(psm1,b(7,3))", "closed_gripper(psm1)", "in_hand(psm1,b(7,3))"}
    assert changing == {
        1: {"reach(psm1,b(7,3))", "max_height(psm2)"},
        2: {"grasp(psm1,b(7,3))", "max_height(psm2)", "at(psm1,b(7,3))"},
        3: {"pull(psm1,b(7,3))", "max_height(psm2)", *holding},
        4: {"max_height(psm2)", "visible_roi", *holding},
    }
    assert all(scene.statics <= set(atoms) for atoms in history.values())


def test_history_tells_where_tools_were_sensed_until_they_leave(planner: Planner) -> None:
    state = [*held("b(7,2)"), "at(psm2,b(2,6))"]
    history = planner.plan(state, tried=["b(7,2)"]).history
    assert sorted(history) == [1, 2, 3, 4, 5]
    there = [t for t, atoms in history.items() if "at(psm1,b(7,2))" in atoms]
    holding = [t for t, atoms in history.items() if "in_hand(psm1,b(7,2))" in atoms]
    other = [t for t, atoms in history.items() if "at(psm2,b(2,6))" in atoms]
    tried = [t for t, atoms in history.items() if "tried(b(7,2))" in atoms]
    assert (there, holding, other, tried) == ([1], [1], [1, 2, 3, 4, 5], [1, 2, 3, 4, 5])
    ignoring = planner.plan([], ignore_ap=True).history
    assert all("ignore_ap" in atoms for atoms in ignoring.values())


def test_b_moves_sideways_at_the_limit(planner: Planner) -> None:
    plan = planner.plan([*held("b(7,3)"), "max_height(psm1)"])
    assert texts(plan) == ["move(psm1,b(5,3))"]
    assert (plan.target, plan.arm) == ("", "psm1")
    assert "max_height(psm1)" in plan.history[1]
    assert "max_height(psm1)" not in plan.history[2]


def test_c_lets_go_of_attached_tissue_and_grasps_anew(planner: Planner) -> None:
    first = planner.plan([], ignore_ap=True)
    assert first.target == "b(5,3)"
    plan = planner.plan([*held("b(1,3)"), "max_height(psm1)"], tried=["b(1,3)"])
    assert texts(plan) == [
        "release(psm1)",
        "reach(psm1,b(7,3))",
        "grasp(psm1,b(7,3))",
        "pull(psm1,b(7,3))",
    ]
    assert plan.actions[0].expected == ("-closed_gripper(psm1)",)
    assert plan.actions[0].args == ("psm1",)


def test_c_lets_go_of_tried_tissue(planner: Planner) -> None:
    plan = planner.plan([*held("b(7,3)"), "max_height(psm1)"], tried=["b(7,3)"])
    assert texts(plan)[0] == "release(psm1)"
    assert plan.target not in {"", "b(7,3)"}
    assert len(plan.actions) == 4


def test_an_interrupted_pull_is_resumed(planner: Planner) -> None:
    assert texts(planner.plan(held("b(7,3)"))) == ["pull(psm1,b(7,3))"]
    assert texts(planner.plan(held("b(3,2)"))) == ["pull(psm1,b(3,2))"]


def test_attached_tissue_is_pulled_on_while_attachments_are_ignored(planner: Planner) -> None:
    assert texts(planner.plan(held("b(1,3)"), ignore_ap=True)) == ["pull(psm1,b(1,3))"]


def test_a_tool_at_the_best_block_grasps_at_once(planner: Planner) -> None:
    assert texts(planner.plan(["at(psm1,b(7,3))"])) == [
        "grasp(psm1,b(7,3))",
        "pull(psm1,b(7,3))",
    ]


def test_the_criterion_outranks_a_shorter_plan(planner: Planner) -> None:
    plan = planner.plan(["at(psm1,b(6,3))"])
    assert texts(plan)[0] == "reach(psm1,b(7,3))"
    assert len(plan.actions) == 3
    closed = planner.plan(["closed_gripper(psm1)"])
    assert texts(closed)[:2] == ["release(psm1)", "reach(psm1,b(7,3))"]


def test_both_arms_let_go_of_spoiled_tissue(planner: Planner) -> None:
    state = [*held("b(1,2)"), *held("b(1,6)", "psm2")]
    actions = texts(planner.plan(state))
    assert actions[:3] == ["release(psm1)", "release(psm2)", "reach(psm1,b(7,3))"]
    assert len(actions) == 5


def test_the_other_arms_tissue_is_let_go_first(planner: Planner) -> None:
    actions = texts(planner.plan(held("b(1,6)", "psm2")))
    assert actions[:2] == ["release(psm2)", "reach(psm1,b(7,3))"]


def test_a_limit_without_tissue_is_forgotten_by_opening(planner: Planner) -> None:
    assert texts(planner.plan(["max_height(psm1)"])) == [
        "release(psm1)",
        "reach(psm1,b(7,3))",
        "grasp(psm1,b(7,3))",
        "pull(psm1,b(7,3))",
    ]


def test_of_several_blocks_in_hand_a_clean_one_gives_its_name(planner: Planner) -> None:
    state = [*held("b(2,3)"), "in_hand(psm1,b(1,3))", "in_hand(psm1,b(2,2))"]
    assert texts(planner.plan(state)) == ["pull(psm1,b(2,2))"]
    assert texts(planner.plan(state, tried=["b(2,2)"])) == ["pull(psm1,b(2,3))"]


def test_goal_reached_is_an_empty_plan_in_words(planner: Planner) -> None:
    plan = planner.plan(["visible_roi"])
    assert plan.actions == ()
    assert plan.no_plan is None
    assert sorted(plan.history) == [1]
    assert plan.explanation == (
        "Nothing is left to do: the goal is reached, the region of interest is visible.",
    )


def test_goal_clear_asks_for_a_move_after_each_crossing(
    knowledge: Knowledge, scene: PlanningScene, planner: Planner
) -> None:
    state = [*held("b(7,3)"), "max_height(psm1)", "visible_roi"]
    assert planner.plan(state).actions == ()
    clear = Planner(knowledge, scene, "weighted", goal="clear")
    assert texts(clear.plan(state)) == ["move(psm1,b(5,3))"]
    assert clear.plan(["visible_roi"]).actions == ()


def test_a_planner_can_be_asked_again(planner: Planner) -> None:
    first = planner.plan([])
    planner.plan([*held("b(7,3)"), "max_height(psm1)"])
    again = planner.plan([])
    assert again.actions == first.actions
    assert again.cost == first.cost
    assert again.history == first.history


def test_times_come_from_the_clock_that_is_given(
    knowledge: Knowledge, scene: PlanningScene
) -> None:
    ticks = iter(range(100))
    planner = Planner(knowledge, scene, "weighted", clock=lambda: float(next(ticks)))
    first, second = planner.plan([]), planner.plan([])
    # Between the two looks before and after a search, the search itself looks twice.
    assert (first.ground_s, first.solve_s, first.told_s) == (1.0, 3.0, 1.0)
    assert (second.ground_s, second.solve_s, second.told_s) == (0.0, 3.0, 1.0)
