"""Why not another block, why not another action: what is missing, what forbids it, by how much."""

from collections.abc import Callable

import numpy as np
import pytest

from fras_planner.planning import (
    Knowledge,
    Planner,
    PlanningScene,
    UnknownAction,
    UnknownArm,
    UnknownBlock,
)

SceneMaker = Callable[..., PlanningScene]

HELD = ["in_hand(psm1,b(2,1))", "closed_gripper(psm1)"]
AT_LIMIT = [*HELD, "max_height(psm1)"]


ATTACHED = (
    "b(1,1) lies over an attachment point. Tissue over an attachment point is not grasped.",
)
ANEW = "It is possible, but a block would have to be grasped anew, and the plan needs none."
OPEN = "psm1 has its gripper open already, and is at no limit."


@pytest.mark.parametrize(
    ("question", "state", "rules", "sentences"),
    [
        ("b(2,2)", [], (), ("b(2,2) is what the plan grasps.",)),
        ("b(1,1)", [], (), ATTACHED),
        (
            "b(2,1)",
            [],
            (),
            (
                "b(2,1) could be grasped, but falls short of b(2,2) by 54 under the criterion "
                "'weighted'.",
                "b(2,1): 40 mm from the nearest attachment, 50 mm from the region of interest; "
                "b(2,2): 57 and 30 mm.",
            ),
        ),
        (
            "b(2,2)",
            HELD,
            (),
            (
                "b(2,2) could be grasped, but the plan needs no new grasp: pull(psm1,b(2,1)) "
                "comes first.",
            ),
        ),
        (
            "b(2,2)",
            ["visible_roi"],
            (),
            ("b(2,2) could be grasped, but the goal is reached: nothing is left to do.",),
        ),
        ("reach(psm2,b(2,2))", [], (), ("reach(psm2,b(2,2)) is the first action of the plan.",)),
        (
            "grasp(psm2, b(2,2))",
            [],
            (),
            ("grasp(psm2,b(2,2)) is action 2 of the plan: reach(psm2,b(2,2)) comes first.",),
        ),
        (
            "reach(psm1,b(2,1))",
            [],
            (),
            ("It is possible, but leads to a block that is worse by 54 under the criterion "
             "'weighted'.",),
        ),
        ("reach(psm1,b(2,2))", [], (), ("psm1 does not reach b(2,2).",)),
        (
            "reach(psm1,b(1,1))",
            [],
            ("keep_off_attachments",),
            ("Rule: Tissue over an attachment point is not grasped.",),
        ),
        (
            "reach(psm1,b(2,1))",
            HELD,
            ("open_gripper_first",),
            ("Rule: A tool reaches and grasps with its gripper open.",),
        ),
        (
            "reach(psm2,b(2,2))",
            HELD,
            ("one_grasp_at_a_time",),
            ("Rule: Tissue in hand is let go before another piece is grasped.",),
        ),
        ("grasp(psm1,b(2,1))", [], (), ("psm1 is not at b(2,1).",)),
        ("grasp(psm1,b(2,2))", ["at(psm1,b(2,2))"], (), ("psm1 does not reach b(2,2).",)),
        ("pull(psm1,b(2,1))", [], (), ("psm1 holds no tissue.",)),
        ("pull(psm1,b(2,2))", HELD, (), ("psm1 does not hold b(2,2).",)),
        (
            "pull(psm1,b(2,1))",
            AT_LIMIT,
            ("respect_limit",),
            ("Rule: An arm at its limit does not pull higher.",),
        ),
        (
            "move(psm1,b(1,2))",
            HELD,
            ("pull_before_moving",),
            ("Rule: Tissue is moved sideways only when it may not be pulled higher.",),
        ),
        (
            "move(psm1,b(2,2))",
            AT_LIMIT,
            (),
            ("Tissue is moved to the block above the region of interest, b(1,2), and not to "
             "b(2,2).",),
        ),
        ("release(psm1)", [], (), (OPEN,)),
        ("release(psm1)", HELD, (), (ANEW,)),
        (
            "reach(psm2,b(2,2))",
            ["visible_roi"],
            (),
            ("It is possible, but nothing is left to do: the goal is reached.",),
        ),
    ],
)  # fmt: skip
def test_the_answer(
    planner: Planner, question: str, state: list[str], rules: tuple[str, ...], sentences: object
) -> None:
    answer = planner.why_not(question, state)
    assert (answer.rules, answer.sentences) == (rules, sentences)
    assert answer.question == question.replace(" ", "")


def test_what_was_tried_is_said(planner: Planner) -> None:
    answer = planner.why_not("b(1,2)", [], tried=["b(1,2)"])
    assert answer.sentences == (
        "b(1,2) was tried in vain. A block that was tried in vain is not tried again.",
    )


def test_with_attachments_ignored_the_way_to_the_roi_counts(planner: Planner) -> None:
    answer = planner.why_not("b(1,1)", [], ignore_ap=True)
    assert answer.sentences[0] == (
        "b(1,1) could be grasped, but is 31 mm farther from the region of interest than b(1,2)."
    )
    answer = planner.why_not("reach(psm2,b(2,2))", [], ignore_ap=True)
    assert answer.sentences == (
        "It is possible, but leads to a block that is 20 mm farther from the region of interest.",
    )


def test_without_any_plan_a_block_is_not_at_fault(
    knowledge: Knowledge, scene: PlanningScene
) -> None:
    short = Planner(knowledge, scene, "weighted", horizon=2)
    assert short.why_not("b(2,2)", []).sentences == (
        "b(2,2) could be grasped, but there is no plan at all.",
    )
    answer = short.why_not("reach(psm2,b(2,2))", [])
    assert answer.rules == ("see_roi",)
    assert answer.sentences == ("After it no plan of at most 2 actions reaches the goal.",)


def test_a_spent_budget_decides_nothing(knowledge: Knowledge, scene: PlanningScene) -> None:
    answer = Planner(knowledge, scene, "weighted", conflict_budget=0).why_not(
        "reach(psm2,b(2,2))", []
    )
    assert answer.rules == ()
    assert answer.sentences == (
        "The search ended before that was decided: allow it more conflicts or more time.",
    )


def test_equals_differ_by_their_indices(knowledge: Knowledge) -> None:
    names = ["b(1,1)", "b(2,2)"]
    statics = [f"reachable(psm1,{name})" for name in names]
    both = PlanningScene.make(names, [(0, 0, 0), (0.02, 0, 0)], (0.01, 0, 0), statics)
    answer = Planner(knowledge, both, "weighted").why_not("b(2,2)", [])
    assert answer.sentences[0] == (
        "b(2,2) could be grasped and is as good as b(1,1): between equals the smallest indices "
        "count."
    )
    answer = Planner(knowledge, both, "weighted").why_not("reach(psm1,b(2,2))", [])
    assert answer.sentences == (
        "It is possible, but leads to another block of equal worth with larger indices.",
    )


def test_the_other_arm_and_one_action_more(knowledge: Knowledge) -> None:
    statics = ["reachable(psm1,b(1,1))", "reachable(psm2,b(1,1))"]
    one = PlanningScene.make(["b(1,1)"], [(0, 0, 0)], (0, 0, 0), statics)
    planner = Planner(knowledge, one, "weighted")
    assert planner.why_not("reach(psm2,b(1,1))", []).sentences == (
        "It is possible, but the other arm comes first where both serve.",
    )
    assert planner.why_not("release(psm1)", ["closed_gripper(psm1)"]).sentences == (
        "It is possible, but lengthens the plan by 1.",
    )


@pytest.mark.parametrize(
    ("question", "error", "says"),
    [
        ("fly(psm1)", UnknownAction, "release(arm)"),
        ("pull(psm1)", UnknownAction, "pull(arm,block)"),
        ("b(9,9)", UnknownBlock, "known: b(1,1), b(1,2), b(2,1), b(2,2)"),
        ("b(x,y)", UnknownAction, "b(i,j)"),
        ("b(0+1,1)", UnknownAction, "b(i,j)"),
        ("pull(psm1,", UnknownAction, "move(arm,block)"),
        ("\u202e\U0001f600", UnknownAction, "b(i,j)"),
        ("b(1,1)\0", UnknownAction, "b(i,j)"),
        ("pull(psm3,b(1,1))", UnknownArm, "psm1, psm2"),
        ("pull(psm1,b(9,9))", UnknownBlock, "b(1,1)"),
    ],
)
def test_a_question_about_what_there_is_not(
    planner: Planner, question: str, error: type[Exception], says: str
) -> None:
    with pytest.raises(error) as caught:
        planner.why_not(question, [])
    assert says in str(caught.value)


NAMED = "#program base. rule(keep_off_edge). forbidden(reach(A,B),keep_off_edge) :- "
WORDS = 'text(keep_off_edge,"Tissue at the edge is not grasped.").'


@pytest.mark.parametrize(
    ("rule", "words", "sentences"),
    [
        (
            NAMED + "reachable(A,B), B = b(2,2).",
            WORDS,
            ("b(2,2) may not be grasped. Tissue at the edge is not grasped.",),
        ),
        (
            NAMED + "reachable(A,B), B = b(2,2).",
            "",
            ("b(2,2) may not be grasped: rule keep_off_edge.",),
        ),
        # The other arm would be free to.
        (
            NAMED + "reachable(A,B), A = psm1, B = b(2,2).",
            WORDS,
            ("b(2,2) is what the plan grasps.",),
        ),
        (
            "#program base. :- target(_,b(2,2)).",
            "",
            (
                "b(2,2) is better than b(1,2) under the criterion 'weighted'; what keeps it from "
                "being grasped is a rule without a name, or takes too long.",
                "b(2,2): 57 mm from the nearest attachment, 30 mm from the region of interest; "
                "b(1,2): 40 and 10 mm.",
            ),
        ),
    ],
)
def test_a_rule_of_ones_own_is_the_answer(
    knowledge: Knowledge,
    scene: PlanningScene,
    rule: str,
    words: str,
    sentences: tuple[str, ...],
) -> None:
    added = {"constraints.lp": rule, "words.lp": words}
    files = {name: f"{text}\n{added.get(name, '')}" for name, text in knowledge.files.items()}
    either = PlanningScene.make(
        scene.names, scene.blocks_m, scene.roi_m, {*scene.statics, "reachable(psm1,b(2,2))"}
    )
    planner = Planner(Knowledge(files, ""), either, "weighted")
    assert planner.why_not("b(2,2)", []).sentences == sentences
    assert planner.why_not("b(1,1)", []).sentences == ATTACHED


def test_asking_changes_no_plan(knowledge: Knowledge, make_scene: SceneMaker) -> None:
    """And each block asked about has an answer that is true by the planner's own measure."""
    rng = np.random.default_rng(5)
    for seed in range(6):
        made = make_scene(5, seed)
        planner = Planner(knowledge, made, "weighted")
        before = planner.plan([])
        for name in rng.choice(made.names, size=5):
            answer = planner.why_not(str(name), [])
            assert answer.sentences
            if str(name) == before.target:
                assert answer.sentences == (f"{name} is what the plan grasps.",)
        assert planner.plan([]).actions == before.actions
        assert planner.plan([]).cost == before.cost


def test_time_that_is_over_decides_nothing(knowledge: Knowledge, scene: PlanningScene) -> None:
    in_time = Planner(knowledge, scene, "weighted").why_not("reach(psm1,b(1,1))", [])
    ticks = iter(range(0, 1000, 2))
    # Enough for the plan, not for the other one beside it.
    planner = Planner(
        knowledge, scene, "weighted", time_limit_s=5.0, clock=lambda: float(next(ticks))
    )
    late = planner.why_not("reach(psm1,b(1,1))", [])
    assert late.rules == ()
    assert late.sentences != in_time.sentences
    assert late.sentences == (
        "The search ended before that was decided: allow it more conflicts or more time.",
    )
