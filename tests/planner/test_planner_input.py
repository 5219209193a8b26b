"""Bad input: each kind is refused with an error that names it."""

from collections.abc import Callable

import pytest

from fras_planner.planning import (
    Context,
    ContradictoryFluents,
    EmptyContext,
    Knowledge,
    Planner,
    PlanningScene,
    SceneChanged,
    SceneOutOfBounds,
    UnknownArm,
    UnknownBlock,
    UnknownCriterion,
    UnknownFluent,
    UnknownGoal,
)

SceneMaker = Callable[..., PlanningScene]


@pytest.fixture(scope="module")
def scene(make_scene: SceneMaker) -> PlanningScene:
    return make_scene(3, 0, fixed=["b(1,1)"])


def context(scene: PlanningScene, *fluents: str) -> Context:
    return Context(scene.names, scene.blocks_m, scene.roi_m, fluents)


@pytest.mark.parametrize(
    "atom",
    [
        "flying(psm1)",
        "at(psm1)",
        "at(psm1,b(1,1),3)",
        "visible_roi(psm1)",
        "-visible_roi",
        "at(psm1,b(1,1)). fixed(b(3,3)",
        "at(psm1,",
        "",
        "17",
        "arm(psm3)",
        # Terms that clingo would work out to others.
        "visible_roi()",
        "at(psm1,b(0+1,1))",
        "fixed(b(1,0x1))",
    ],
)
def test_what_is_not_in_the_signature_is_refused(planner: Planner, atom: str) -> None:
    with pytest.raises(UnknownFluent) as caught:
        planner.plan([atom])
    assert caught.value.atom == "".join(atom.split())
    assert "at(arm,block)" in caught.value.known
    assert "visible_roi" in str(caught.value)


def test_an_unknown_block_is_named_with_the_known_ones(planner: Planner) -> None:
    for state, tried in ((["at(psm1,b(4,1))"], []), ([], ["b(4,1)"])):
        with pytest.raises(UnknownBlock) as caught:
            planner.plan(state, tried=tried)
        assert caught.value.block == "b(4,1)"
        assert set(caught.value.known) == {f"b({i},{j})" for i in (1, 2, 3) for j in (1, 2, 3)}


def test_an_unknown_arm_is_named_with_the_known_ones(planner: Planner) -> None:
    with pytest.raises(UnknownArm) as caught:
        planner.plan(["closed_gripper(psm3)"])
    assert (caught.value.arm, caught.value.known) == ("psm3", ("psm1", "psm2"))


def test_static_atoms_are_checked_too(knowledge: Knowledge, scene: PlanningScene) -> None:
    for atom, error in (
        ("fixed(b(9,9))", UnknownBlock),
        ("reachable(psm7,b(1,1))", UnknownArm),
        ("fixed(psm1,b(1,1))", UnknownFluent),
    ):
        bad = PlanningScene.make(scene.names, scene.blocks_m, scene.roi_m, [atom])
        with pytest.raises(error):
            Planner(knowledge, bad)


def test_contradictory_fluents_are_named(planner: Planner) -> None:
    state = ["in_hand(psm1,b(1,2))", "at(psm1,b(1,2))", "closed_gripper(psm2)"]
    with pytest.raises(ContradictoryFluents) as caught:
        planner.plan(state)
    assert caught.value.atoms == ("at(psm1,b(1,2))", "in_hand(psm1,b(1,2))")
    assert caught.value.rule == "open_gripper_holds"
    assert set(caught.value.known) == set(state)


def test_contradictions_come_before_the_lack_of_a_plan(
    planner: Planner, scene: PlanningScene
) -> None:
    with pytest.raises(ContradictoryFluents):
        planner.plan(["in_hand(psm1,b(1,2))"], tried=scene.names)
    assert planner.plan([], tried=scene.names).no_plan is not None


def test_after_a_refusal_the_planner_goes_on(planner: Planner) -> None:
    before = planner.plan([])
    for bad in ("at(psm1,b(4,1))", "in_hand(psm1,b(1,2))"):
        with pytest.raises((UnknownBlock, ContradictoryFluents)):
            planner.plan(["max_height(psm1)", bad])
    assert planner.plan([]).actions == before.actions


def test_an_empty_context_is_refused(knowledge: Knowledge, scene: PlanningScene) -> None:
    with pytest.raises(EmptyContext, match="no blocks"):
        PlanningScene.from_context(Context((), (), (0, 0, 0), ("visible_roi",)), knowledge)
    with pytest.raises(EmptyContext, match="no fluents"):
        PlanningScene.from_context(context(scene), knowledge)
    with pytest.raises(EmptyContext, match="no blocks"):
        Planner(knowledge, PlanningScene.make([], [], (0, 0, 0), []))


def test_a_scene_is_what_lasts_of_a_context(
    knowledge: Knowledge, scene: PlanningScene, planner: Planner
) -> None:
    fluents = [atom.replace(",", ", ") for atom in scene.statics]
    made = PlanningScene.from_context(context(scene, "max_height(psm1)", *fluents), knowledge)
    assert made == scene
    assert planner.plan(fluents).actions == planner.plan([]).actions
    with pytest.raises(UnknownFluent):
        PlanningScene.from_context(context(scene, "flying(psm1)"), knowledge)


def test_a_changed_scene_needs_a_new_planner(planner: Planner, scene: PlanningScene) -> None:
    with pytest.raises(SceneChanged) as caught:
        planner.plan([*scene.statics, "fixed(b(3,3))"])
    assert caught.value.atoms == ("fixed(b(3,3))",)


@pytest.mark.parametrize("name", ["c(1,1)", "b(0,1)", "b(1)", "b(1,1).x", "b(1,999999)"])
def test_block_names_must_be_indices(knowledge: Knowledge, name: str) -> None:
    with pytest.raises(SceneOutOfBounds, match="block name"):
        Planner(knowledge, PlanningScene.make([name], [(0, 0, 0)], (0, 0, 0), []))


@pytest.mark.parametrize(
    ("names", "blocks", "roi", "quantity"),
    [
        (["b(1,1)"], [(0, float("nan"), 0)], (0, 0, 0), "b(1,1)"),
        (["b(1,1)"], [(0, 0, 11.0)], (0, 0, 0), "b(1,1)"),
        (["b(1,1)"], [(0, 0)], (0, 0, 0), "b(1,1)"),
        (["b(1,1)"], [(0, 0, 0)], (0, float("inf"), 0), "roi_m"),
        (["b(1,1)"], [], (0, 0, 0), "rows of blocks_m"),
        (["b(1,1)", "b(1,1)"], [(0, 0, 0)] * 2, (0, 0, 0), "block names"),
    ],
)
def test_malformed_geometry_is_refused(
    knowledge: Knowledge,
    names: list[str],
    blocks: list[tuple[float, ...]],
    roi: tuple[float, ...],
    quantity: str,
) -> None:
    with pytest.raises(SceneOutOfBounds) as caught:
        Planner(knowledge, PlanningScene.make(names, blocks, roi, []))
    assert caught.value.quantity == quantity


def test_too_many_blocks_are_refused_before_grounding(knowledge: Knowledge) -> None:
    names = [f"b({i},{j})" for i in range(1, 102) for j in range(1, 102)]
    with pytest.raises(SceneOutOfBounds, match="number of blocks"):
        Planner(knowledge, PlanningScene.make(names, [(0, 0, 0)] * len(names), (0, 0, 0), []))


def test_scores_near_the_limit_of_integers_stay_right(knowledge: Knowledge) -> None:
    far = [(0.0, 0.0, 0.0), (10.0, 10.0, 10.0), (-10.0, -10.0, -10.0)]
    names = ["b(1,1)", "b(1,2)", "b(1,3)"]
    statics = [*(f"reachable(psm1,{name})" for name in names), "fixed(b(1,3))"]
    scene = PlanningScene.make(names, far, (10, 10, 0), statics)
    for criterion in knowledge.criteria:
        assert Planner(knowledge, scene, criterion).plan([]).target == "b(1,2)"


def test_options_that_do_not_exist_are_refused(knowledge: Knowledge, scene: PlanningScene) -> None:
    with pytest.raises(UnknownCriterion, match="weighted"):
        Planner(knowledge, scene, "best")
    with pytest.raises(UnknownGoal, match="visible, clear"):
        Planner(knowledge, scene, goal="done")
    with pytest.raises(SceneOutOfBounds, match="horizon"):
        Planner(knowledge, scene, horizon=0)
