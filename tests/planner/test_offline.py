"""Contexts from a file: what is read, what is refused, what comes out."""

import json
from pathlib import Path
from typing import Any

import pytest

from fras_common.digests import rules_digest
from fras_planner.knowledge import AttachedRulesUnusable, load_knowledge
from fras_planner.offline import BadContext, plan_file, read_contexts, verify_history
from fras_planner.planning import UnknownAction, UnknownCriterion, UnknownFluent

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES, ASP = ROOT / "examples" / "contexts.json", ROOT / "asp"
CONTEXT: dict[str, Any] = {
    "names": ["b(1,1)", "b(1,2)"],
    "blocks_m": [[0, 0, 0], [0, 0.02, 0]],
    "roi_m": [0, 0.02, 0],
    "fluents": ["reachable(psm1,b(1,1))", "reachable(psm1,b(1,2))", "above_roi(b(1,2))"],
}


def planned(content: Any, **options: Any) -> tuple[list[dict[str, Any]], bool]:
    settings: dict[str, Any] = {
        "criterion": "weighted", "goal": "visible", "asp_dir": None, "questions": [], **options
    }  # fmt: skip
    return plan_file(json.dumps(content), "contexts.json", **settings)


def test_one_context_is_one_plan() -> None:
    rows, is_list = planned(CONTEXT)
    assert not is_list
    (row,) = rows
    assert row["target"] == "b(1,2)"
    assert row["arm"] == "psm1"
    assert [(action["t"], action["text"]) for action in row["actions"]] == [
        (1, "reach(psm1,b(1,2))"),
        (2, "grasp(psm1,b(1,2))"),
        (3, "pull(psm1,b(1,2))"),
    ]
    assert row["no_plan"] is None
    assert row["ground_s"] > 0.0
    assert row["solve_s"] > 0.0
    assert row["models"] >= 1
    assert "visible_roi" in row["history"]["4"]
    assert json.loads(json.dumps(row)) == row


def test_the_examples_are_the_paper_s_three_situations() -> None:
    rows, is_list = planned(json.loads(EXAMPLES.read_text()))
    assert is_list
    names = [[action["name"] for action in row["actions"]] for row in rows]
    assert names == [
        ["reach", "grasp", "pull"],
        ["move"],
        ["release", "reach", "grasp", "pull"],
    ]


def test_contexts_of_one_scene_are_grounded_once() -> None:
    again = {**CONTEXT, "fluents": [*CONTEXT["fluents"], "visible_roi"]}
    rows, _ = planned([CONTEXT, again, {**CONTEXT, "roi_m": [0, 0, 0]}])
    assert [row["ground_s"] > 0.0 for row in rows] == [True, False, True]


def test_options_and_questions_reach_the_planner() -> None:
    fixed = {**CONTEXT, "fluents": [*CONTEXT["fluents"], "fixed(b(1,2))"], "ignore_ap": True}
    rows, _ = planned(fixed, questions=["b(1,1)"])
    assert rows[0]["target"] == "b(1,2)"
    assert rows[0]["why_not"][0]["question"] == "b(1,1)"
    rows, _ = planned({**CONTEXT, "tried": ["b(1,2)"]}, criterion="lex")
    assert rows[0]["target"] == "b(1,1)"


def test_no_plan_is_an_answer() -> None:
    rows, _ = planned({**CONTEXT, "tried": CONTEXT["names"]})
    assert rows[0]["no_plan"]["core"] == ["see_roi", "try_once"]
    assert rows[0]["actions"] == []


def test_a_context_refused_does_not_cost_the_others() -> None:
    rows, _ = planned([{**CONTEXT, "fluents": ["flying(psm1)"]}, CONTEXT])
    assert rows[0]["error"]["type"] == "UnknownFluent"
    assert rows[0]["error"]["atom"] == "flying(psm1)"
    assert rows[1]["target"] == "b(1,2)"


def test_a_context_alone_is_refused_with_its_error() -> None:
    with pytest.raises(UnknownFluent, match="flying"):
        planned({**CONTEXT, "fluents": ["flying(psm1)"]})
    with pytest.raises(UnknownAction, match="fly"):
        planned(CONTEXT, questions=["fly(psm1)"])
    with pytest.raises(UnknownCriterion, match="known: capped, lex"):
        planned([], criterion="best")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "Input data was truncated"),
        ("{", "Input data was truncated"),
        ("[" * 100_000, "recursion|truncated"),
        (b'{"names": ["\xff"]}', "utf-8"),
        ("3", "Expected `object`, got `int`"),
        ('{"names": []}', "missing required field `blocks_m`"),
        (json.dumps({**CONTEXT, "blocks_m": [[0, 0]]}), r"\$\[0\].blocks_m\[0\]"),
        (json.dumps([CONTEXT, {**CONTEXT, "names": [1]}]), r"\$\[1\].names\[0\]"),
        (json.dumps({**CONTEXT, "fluents": None}), r"\$\[0\].fluents"),
    ],
)
def test_what_is_no_context_is_refused_with_its_place(text: str | bytes, says: str) -> None:
    with pytest.raises(BadContext, match=says) as caught:
        read_contexts(text, "here.json")
    assert str(caught.value).startswith("here.json: ")


def test_a_recorded_message_is_a_context() -> None:
    seen = {"visible_fraction": 0.25, "threshold_fraction": 0.7}
    monitored = [{"atom": "at(psm1,b(1,2))", "holds": False, "evidence": {"distance_m": 0.02}}]
    recorded = {**CONTEXT, "tick": 3, "trial": "t", "evidence": {"visible_roi": seen}}
    recorded["monitored"] = monitored
    contexts, _ = read_contexts(json.dumps(recorded), "here.json")
    assert contexts[0].names == ("b(1,1)", "b(1,2)")
    rows, _ = planned({**recorded, "reason": "exposure"})
    assert rows[0]["explanation"][1].startswith("25.0 % of the tissue")


def test_a_history_is_verified_in_words() -> None:
    steps = {1: ["reach(psm1,b(1,1))", "closed_gripper(psm1)", *CONTEXT["fluents"]]}
    judged = verify_history(steps)
    assert judged.broken == ("step 1: psm1 reaches for b(1,1) with its gripper closed.",)
    assert judged.ours
    assert judged.asp_digest == judged.our_digest


def test_the_specifications_attached_go_before_ours_and_those_asked_for_before_both() -> None:
    steps = {1: ["reach(psm1,b(1,1))", "closed_gripper(psm1)", *CONTEXT["fluents"]]}
    own = dict(load_knowledge().files)
    words = own["verify.lp"].replace("with its gripper closed", "with its jaw shut")
    attached = {**own, "verify.lp": words}
    judged = verify_history(steps, None, attached, "a.mcap")
    assert judged.broken == ("step 1: psm1 reaches for b(1,1) with its jaw shut.",)
    assert judged.asp_digest == rules_digest(attached) != judged.our_digest
    assert not judged.ours
    # Other preferences promise the same.
    same = verify_history(steps, None, {**own, "goal.lp": own["goal.lp"] + "% mine\n"}, "a.mcap")
    assert same.ours
    assert same.asp_digest != same.our_digest
    asked = verify_history(steps, ASP, attached, "a.mcap")
    assert asked.ours
    assert asked.broken == ("step 1: psm1 reaches for b(1,1) with its gripper closed.",)


def test_attached_rules_without_specifications_are_no_promise() -> None:
    own = load_knowledge().files
    rest = {name: text for name, text in own.items() if name != "verify.lp"}
    with pytest.raises(AttachedRulesUnusable, match=r"a\.mcap.*verify\.lp: this file is missing"):
        verify_history({1: ["reach(psm1,b(1,1))"]}, None, rest, "a.mcap")
