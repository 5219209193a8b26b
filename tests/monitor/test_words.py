"""No shorthand reaches a surgeon: names, actions, atoms and reasons become words."""

import re

import pytest

from fras_common.messages import NoPlan
from fras_monitor.timetable import changes, why
from fras_monitor.words import (
    action_in_words,
    evidence_in_words,
    fluent_in_words,
    hold_in_words,
    phase_in_words,
    plain,
    reason_in_words,
)
from support import pictures as p

SHORTHAND = re.compile(r"psm\d|b\(|\bROI\b|_roi|_gripper|max_height|in_hand|\w\(")
ACTIONS = (
    "reach(psm1,b(3,4))",
    "grasp(psm2,b(10,12))",
    "pull(psm1,b(3,4))",
    "move(psm1,b(3,4))",
    "release(psm2)",
)
FLUENTS = (
    "reachable(psm1,b(1,1))",
    "at(psm1,b(1,1))",
    "in_hand(psm2,b(1,1))",
    "closed_gripper(psm1)",
    "max_height(psm1)",
    "fixed(b(1,1))",
    "above_roi(b(1,1))",
    "visible_roi",
)
REASONS = (
    "initial", "exposure", "force", "force_soft", "force_hard", "hold", "restart", "replans",
    "nothing_in_reach", "hold:solver", "hold:sim", "hold:monitor:stop pressed",
    "refused: workspace", "gate:tool_distance",
    "deviation: in_hand(psm1,b(3,4)) expected after grasp(psm1,b(3,4)); distance_m 0.01",
    "deviation: -closed_gripper(psm1) expected after release(psm1)", "rejected",
)  # fmt: skip


@pytest.mark.parametrize("under_way", [False, True])
@pytest.mark.parametrize("text", ACTIONS)
def test_each_action_of_the_signature_has_words(text: str, under_way: bool):
    told = action_in_words(text, under_way=under_way)
    assert not SHORTHAND.search(told)
    assert told.startswith(("Right instrument: ", "Left instrument: "))


def test_an_action_says_who_does_what_where():
    assert action_in_words("pull(psm1,b(3,4))") == "Right instrument: lift the tissue at point 3-4"
    told = phase_in_words("acting", "reach(psm2,b(7,6))")
    assert told == "Left instrument: reaching for point 7-6"


@pytest.mark.parametrize("atom", FLUENTS)
def test_each_fluent_has_words_and_so_has_its_absence(atom: str):
    told = fluent_in_words(atom)
    assert told != atom
    assert not SHORTHAND.search(told)
    assert fluent_in_words(f"-{atom}") == f"not: {told}"


@pytest.mark.parametrize("reason", REASONS)
def test_each_reason_has_words(reason: str):
    assert not SHORTHAND.search(reason_in_words(reason))


@pytest.mark.parametrize(
    ("holder", "reason", "told"),
    [
        ("monitor", "", "stopped on this page"),
        ("cli", "bleeding", "stopped at a terminal (bleeding)"),
        ("sim", "", "waiting for the tissue model"),
        ("client:somebody", "", "stopped by somebody"),
        ("recorder", "", "nothing is being recorded"),
    ],
)
def test_who_holds_and_why(holder: str, reason: str, told: str):
    assert hold_in_words(holder, reason) == told


def test_a_sentence_of_the_planner_is_put_into_words():
    said = (
        "psm1 grasps b(3,4): no other arm reaches it, 13 mm from the region of "
        "interest; best of 25 candidate blocks under the criterion 'weighted'."
    )
    assert plain(said) == (
        "the right instrument grasps point 3-4: no other instrument reaches it, 13 mm from "
        "the target region; best of 25 possible points by the chosen preference."
    )


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("it lies over an attachment point.", "it lies over an attachment."),
        ("attachment points are ignored", "attachments are ignored"),
        ("the arm control refused", "the arm control refused"),
    ],
)
def test_one_and_many_are_told_apart(said: str, told: str):
    assert plain(said) == told


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("distance_m", 1.04e-17, "distance 0 mm"),
        ("at_distance_m", 0.005, "counts as there up to 5 mm"),
        ("jaw_rad", -0.3490658503988659, "jaws at -20 °"),
        ("threshold_fraction", 0.995, "needed: more than 99.5%"),
        ("max_force_n", 0.51234, "max force 0.51 N"),
        ("fixed_points", 42.0, "attachments under it 42"),
        ("roi_offset_x_m", 0.0129, "the target region lies behind it by 12.9 mm"),
        ("rest_y_m", 0.0086, "from the right edge, at rest 8.6 mm"),
    ],
)
def test_evidence_has_units(name: str, value: float, told: str):
    assert evidence_in_words(name, value) == told


def test_what_a_later_plan_does_otherwise():
    before = p.plan("c1", ignore_ap=True)
    after = p.plan(
        "c2", *ACTIONS[:1], reason="force", tried=["b(3,4)"], target="b(5,5)", arm="psm2"
    )
    assert changes(before, after) == [
        "New plan because the force limit was crossed.",
        "Point 3-4 is not tried again.",
        "Attachments, which the first plan ignored, count from now on.",
        "The tissue is held at point 5-5 instead of point 3-4.",
        "The left instrument works instead of the right instrument.",
    ]


def test_why_there_is_no_plan_is_told_in_its_place():
    none = NoPlan(core=["try_once"], sentences=["No arm reaches any block."])
    assert why(p.plan("c1", no_plan=none)) == ["No instrument reaches any point."]
