"""The rules of actions.lp, one by one: facts in, what may occur out, and what is best."""

import pytest

from fras_planner.planning import Knowledge
from planner.mutants import models

GIVEN = (
    "#defined aimed/1. #defined at/3. #defined in_hand/3. #defined closed_gripper/2."
    "#defined max_height/2. #defined above_roi/1. arm(psm1;psm2). "
)
TWO = [("step", (1,)), ("step", (2,))]
CLOSED = "closed_gripper(psm1,1..2). closed_gripper(psm2,1..2). "


def occurring(atoms: frozenset[str]) -> str:
    return " ".join(sorted(atom for atom in atoms if atom.startswith("occurs(")))


def courses(knowledge: Knowledge, facts: str, steps: int = 1, best: bool = False) -> list[str]:
    """What may occur in some steps; what does at best."""
    found = models(knowledge, ["actions.lp"], GIVEN + facts, TWO[:steps], best=best)
    return sorted(occurring(atoms) for atoms in found)


@pytest.mark.parametrize(
    ("facts", "may"),
    [
        pytest.param("", "", id="nothing"),
        pytest.param("aimed(psm1).", "occurs(reach,psm1,1)", id="reach"),
        pytest.param("at(target,psm1,1).", "occurs(grasp,psm1,1)", id="grasp"),
        pytest.param("at(start,psm1,1). at(target,psm1,2).", "", id="grasp-not_there"),
        pytest.param("in_hand(start,psm1,1).", "occurs(pull,psm1,1)", id="pull-start"),
        pytest.param("in_hand(target,psm1,1).", "occurs(pull,psm1,1)", id="pull-target"),
        pytest.param("in_hand(target,psm1,2).", "", id="pull-not_yet"),
        pytest.param(
            "in_hand(start,psm1,1). above_roi(b(1,1)).",
            "occurs(move,psm1,1) occurs(pull,psm1,1)",
            id="move",
        ),
        pytest.param(
            "in_hand(target,psm1,1). above_roi(b(1,1)).",
            "occurs(pull,psm1,1)",
            id="move-not_a_fresh_grasp",
        ),
        pytest.param("above_roi(b(1,1)).", "", id="move-nothing_in_hand"),
        pytest.param("closed_gripper(psm2,1).", "occurs(release,psm2,1)", id="release-closed"),
        pytest.param("max_height(psm2,1).", "occurs(release,psm2,1)", id="release-limit"),
        pytest.param(
            "aimed(psm1). closed_gripper(psm2,1).",
            "occurs(reach,psm1,1) occurs(release,psm2,1)",
            id="one_action_a_step",
        ),
    ],
)
def test_occurs(knowledge: Knowledge, facts: str, may: str) -> None:
    assert courses(knowledge, facts) == sorted(["", *may.split()])


def test_roi_known(knowledge: Knowledge) -> None:
    (atoms,) = models(knowledge, ["actions.lp"], GIVEN + "above_roi(b(1,1)).")
    assert "roi_known" in atoms
    assert models(knowledge, ["actions.lp"], GIVEN) == [frozenset({"arm(psm1)", "arm(psm2)"})]


def test_busy(knowledge: Knowledge) -> None:
    for atoms in models(knowledge, ["actions.lp"], GIVEN + "aimed(psm1).", TWO):
        for t in (1, 2):
            assert (f"busy({t})" in atoms) == (f"occurs(reach,psm1,{t})" in atoms)


def test_no_pause(knowledge: Knowledge) -> None:
    assert courses(knowledge, "at(target,psm1,2).", 2) == [""]
    assert courses(knowledge, "at(target,psm1,1).", 2) == ["", "occurs(grasp,psm1,1)"]


def test_release_in_the_order_of_the_arms(knowledge: Knowledge) -> None:
    both = [course for course in courses(knowledge, CLOSED, 2) if course.count("release") == 2]
    assert both == [
        "occurs(release,psm1,1) occurs(release,psm1,2)",
        "occurs(release,psm1,1) occurs(release,psm2,2)",
        "occurs(release,psm2,1) occurs(release,psm2,2)",
    ]


@pytest.mark.parametrize(
    ("facts", "steps", "best"),
    [
        pytest.param("aimed(psm1).", 2, [""], id="minimize_busy"),
        pytest.param(
            "aimed(psm1). aimed(psm2). :- not busy(1).",
            1,
            ["occurs(reach,psm1,1)"],
            id="minimize_psm2",
        ),
        pytest.param(
            "aimed(psm1). closed_gripper(psm1,1..2). :- not busy(2)."
            ":- #count { T : occurs(release,_,T) } != 1.",
            2,
            ["occurs(reach,psm1,2) occurs(release,psm1,1)"],
            id="minimize_release_early",
        ),
        pytest.param(
            "aimed(psm1;psm2). :- not busy(1). :- occurs(_,psm1,1). :- busy(2).",
            2,
            ["occurs(reach,psm2,1)"],
            id="minimize_psm2-if_it_must",
        ),
    ],
)
def test_best(knowledge: Knowledge, facts: str, steps: int, best: list[str]) -> None:
    assert courses(knowledge, facts, steps, best=True) == best
