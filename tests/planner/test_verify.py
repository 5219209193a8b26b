"""The safety specifications: each is broken by a history made for it, and by no plan."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from fras_planner.planning import (
    Knowledge,
    KnowledgeFault,
    Planner,
    PlanningError,
    PlanningScene,
    UnknownFluent,
    verify,
)
from support.planning import random_state

SceneMaker = Callable[..., PlanningScene]

SCENE = (
    "reachable(psm1,b(1,1))",
    "reachable(psm1,b(1,2))",
    "reachable(psm2,b(2,2))",
    "fixed(b(1,2))",
    "above_roi(b(2,2))",
)
HELD = ("at(psm1,b(1,1))", "in_hand(psm1,b(1,1))", "closed_gripper(psm1)")
# A retraction that keeps to all: reach, grasp, pull to the limit, move, let go, grasp anew.
SOUND: tuple[tuple[str, ...], ...] = (
    ("reach(psm1,b(1,1))", *SCENE),
    ("grasp(psm1,b(1,1))", "at(psm1,b(1,1))"),
    ("pull(psm1,b(1,1))", *HELD),
    ("move(psm1,b(2,2))", *HELD, "max_height(psm1)"),
    ("release(psm1)", *HELD),
    ("reach(psm1,b(1,1))",),
    ("grasp(psm1,b(1,1))", "at(psm1,b(1,1))"),
    ("pull(psm1,b(1,1))", *HELD),
)


def history(*steps: tuple[str, ...]) -> dict[int, tuple[str, ...]]:
    return dict(enumerate(steps, start=1))


def test_a_sound_history_keeps_to_all(knowledge: Knowledge) -> None:
    assert verify(knowledge, history(*SOUND)) == ()
    assert verify(knowledge, {}) == ()


@pytest.mark.parametrize(
    ("rule", "step", "words"),
    [
        (
            "one_at_a_time",
            ("reach(psm2,b(2,2))", "reach(psm1,b(1,1))"),
            "reach(psm1,b(1,1)) and reach(psm2,b(2,2)) at once",
        ),
        (
            "within_reach",
            ("reach(psm1,b(2,2))",),
            "psm1 reaches for b(2,2), which it does not reach",
        ),
        (
            "open_before_reach",
            ("reach(psm1,b(1,1))", "closed_gripper(psm1)"),
            "psm1 reaches for b(1,1) with its gripper closed",
        ),
        (
            "open_before_grasp",
            ("grasp(psm1,b(1,1))", "at(psm1,b(1,1))", "closed_gripper(psm1)"),
            "psm1 grasps b(1,1) with its gripper closed",
        ),
        (
            "there_before_grasp",
            ("grasp(psm1,b(1,1))", "at(psm2,b(1,1))", "at(psm1,b(2,2))"),
            "psm1 grasps b(1,1) without being there",
        ),
        (
            "one_grasp",
            ("grasp(psm1,b(1,1))", "at(psm1,b(1,1))", "in_hand(psm2,b(2,2))"),
            "psm1 grasps b(1,1) while tissue is in hand",
        ),
        (
            "one_holder",
            ("release(psm2)", *HELD, "in_hand(psm2,b(2,2))"),
            "psm1 and psm2 hold tissue at once",
        ),
        (
            "off_attachments",
            ("grasp(psm1,b(1,2))", "at(psm1,b(1,2))"),
            "psm1 grasps b(1,2), which lies over an attachment point",
        ),
        (
            "attached_stays",
            ("pull(psm1,b(1,2))", "in_hand(psm1,b(1,2))"),
            "psm1 pulls b(1,2), which lies over an attachment point",
        ),
        (
            "not_twice",
            ("grasp(psm1,b(1,1))", "at(psm1,b(1,1))", "tried(b(1,1))"),
            "psm1 grasps b(1,1), which was tried in vain",
        ),
        (
            "below_limit",
            ("pull(psm1,b(1,1))", *HELD, "max_height(psm1)"),
            "psm1 pulls b(1,1) higher although its limit was reached",
        ),
        (
            "holds_what_it_pulls",
            ("pull(psm1,b(1,1))", "in_hand(psm1,b(2,2))"),
            "psm1 pulls b(1,1), which it does not hold",
        ),
        (
            "holds_what_it_moves",
            ("move(psm1,b(2,2))", "max_height(psm1)", "in_hand(psm2,b(2,2))"),
            "psm1 moves to b(2,2) without tissue in hand",
        ),
        (
            "moves_to_the_roi",
            ("move(psm1,b(1,1))", *HELD, "max_height(psm1)"),
            "psm1 moves to b(1,1), which is not above the region of interest",
        ),
        (
            "pull_first",
            ("move(psm1,b(2,2))", *HELD, "max_height(psm2)"),
            "psm1 moves to b(2,2) although it may pull higher",
        ),
    ],
)
def test_each_specification_is_broken_by_itself(
    knowledge: Knowledge, rule: str, step: tuple[str, ...], words: str
) -> None:
    found = verify(knowledge, history(SCENE, step))
    assert [(one.rule, one.t, one.sentence) for one in found] == [(rule, 2, f"step 2: {words}.")]


def test_a_grasp_lasts_until_it_is_let_go(knowledge: Knowledge) -> None:
    """Whatever is sensed: here the tissue has slipped out of a gripper that seems open."""
    grasp = ("grasp(psm1,b(1,1))", "at(psm1,b(1,1))")
    reach = ("reach(psm1,b(1,1))",)
    found = verify(knowledge, history(SCENE, grasp, reach, reach, grasp))
    assert [(one.rule, one.t) for one in found] == [("release_before_regrasp", 5)]
    assert verify(knowledge, history(SCENE, grasp, ("release(psm1)",), reach, grasp)) == ()
    other = ("grasp(psm2,b(2,2))", "at(psm2,b(2,2))")
    assert verify(knowledge, history(SCENE, grasp, ("release(psm1)",), other)) == ()


def test_told_to_ignore_attachments_it_may_grasp_and_pull_them(knowledge: Knowledge) -> None:
    grasp = ("grasp(psm1,b(1,2))", "at(psm1,b(1,2))", "ignore_ap")
    pull = ("pull(psm1,b(1,2))", "in_hand(psm1,b(1,2))", "ignore_ap")
    assert verify(knowledge, history(SCENE, grasp, pull)) == ()
    found = verify(knowledge, history(SCENE, grasp, pull[:-1]))
    assert [one.rule for one in found] == ["attached_stays"]


def test_violations_come_in_the_order_of_the_steps(knowledge: Knowledge) -> None:
    far = ("reach(psm1,b(2,2))",)
    found = verify(knowledge, {30: far, 4: (*far, *SCENE), 200: far})
    assert [one.t for one in found] == [4, 30, 200]


def test_a_specification_without_words_is_a_fault(knowledge: Knowledge) -> None:
    text = knowledge.files["verify.lp"].replace("specification(pull_first,", "specification(pull,")
    wordless = dataclasses.replace(knowledge, files={**knowledge.files, "verify.lp": text})
    broken = history(SCENE, ("move(psm1,b(2,2))", *HELD))
    with pytest.raises(KnowledgeFault, match=r"verify\.lp: violation\(pull_first"):
        verify(wordless, broken)


def test_an_atom_that_is_neither_fluent_nor_action_is_refused(knowledge: Knowledge) -> None:
    with pytest.raises(UnknownFluent, match="cauterise"):
        verify(knowledge, history(("cauterise(psm1)",)))


def test_a_gap_in_the_steps_forgets_no_grasp(knowledge: Knowledge) -> None:
    grasp = ("grasp(psm1,b(1,1))", "at(psm1,b(1,1))")
    found = verify(knowledge, {2: SCENE, 5: grasp, 9: grasp})
    assert [(one.rule, one.t) for one in found] == [("release_before_regrasp", 9)]
    assert found[0].sentence.startswith("step 9: ")


@pytest.mark.parametrize(
    "atom",
    [
        "reach(psm1", "visible_roi(x", "fixed(b(1,1)", "reach", "release(psm1,psm1)",
        "pull(psm7,b(1,1))", "reachable(psm1,b(1,1)). reachable(psm2,b(1,1))",
    ],
)  # fmt: skip
def test_a_malformed_atom_is_refused(knowledge: Knowledge, atom: str) -> None:
    with pytest.raises(PlanningError):
        verify(knowledge, history((atom,)))


@pytest.mark.parametrize(
    "rules",
    [
        'specification(foo,"{} and {}"). violation(foo,T,(A,)) :- done(reach(A,_),T).',
        'specification(foo,"{x} {"). violation(foo,T,(A,)) :- done(reach(A,_),T).',
        'specification(foo,"{}"). violation(foo,T,5) :- done(reach(A,_),T).',
        'specification(foo,"{}"). violation(foo,now,(A,)) :- done(reach(A,_),T).',
        "specification(foo,bar). violation(foo,T,(A,)) :- done(reach(A,_),T).",
        "violation(foo,T) :- done(reach(_,_),T).",
    ],
)
def test_a_specification_that_can_not_be_said_is_a_fault(knowledge: Knowledge, rules: str) -> None:
    text = knowledge.files["verify.lp"] + rules
    own = dataclasses.replace(knowledge, files={**knowledge.files, "verify.lp": text})
    with pytest.raises(KnowledgeFault):
        verify(own, history(SOUND[0]))


@pytest.mark.parametrize("goal", ["visible", "clear"])
def test_every_plan_keeps_to_all(knowledge: Knowledge, make_scene: SceneMaker, goal: str) -> None:
    """But for what was sensed at the start, which no plan can undo: two arms that hold tissue."""
    rng = np.random.default_rng(17)
    kinds: set[str] = set()
    for seed in range(4):
        scene = make_scene(4, seed)
        planner = Planner(knowledge, scene, "weighted", goal=goal)
        for _ in range(40):
            state = random_state(rng, scene.names)
            tried = [name for name in scene.names if rng.random() < 0.2]
            plan = planner.plan(state, bool(rng.random() < 0.2), tried)
            kinds |= {action.name for action in plan.actions}
            broken = {one.rule for one in verify(knowledge, plan.history)}
            assert broken <= {"one_holder"}, (state, tried, plan.actions)
    assert kinds == {"reach", "grasp", "pull", "move", "release"}
