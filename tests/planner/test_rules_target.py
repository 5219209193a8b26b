"""The rules of target.lp, one by one: facts in, atoms out, and what is best."""

import pytest

from fras_planner.planning import Knowledge
from planner.mutants import models

GIVEN = (
    "#defined reachable/2. #defined roi_distance/2. #defined preference/3. #defined ignore_ap/0. "
)
REACHED = "reachable(psm1,b(1,1)). reachable(psm1,b(2,1)). reachable(psm2,b(2,1)). "
# As much worth, as far away: which is best is told by the facts that a test adds.
FOUR = "reachable(psm1,(b(2,10);b(2,2);b(10,2);b(10,10))). "
AIM = ":- not target(_,_). "


def targets(atoms: frozenset[str]) -> set[str]:
    return {atom for atom in atoms if atom.startswith("target(")}


def test_target_one_at_most_of_what_an_arm_reaches(knowledge: Knowledge) -> None:
    found = [targets(atoms) for atoms in models(knowledge, ["target.lp"], GIVEN + REACHED)]
    assert sorted(map(sorted, found)) == [
        [],
        ["target(psm1,b(1,1))"],
        ["target(psm1,b(2,1))"],
        ["target(psm2,b(2,1))"],
    ]


def test_aimed_and_aimed_at(knowledge: Knowledge) -> None:
    facts = GIVEN + REACHED + ":- not target(psm1,b(2,1)). "
    (atoms,) = models(knowledge, ["target.lp"], facts)
    assert {"aimed(psm1)", "aimed_at(b(2,1))"} <= atoms
    assert not {"aimed(psm2)", "aimed_at(b(1,1))"} & atoms
    (none,) = models(knowledge, ["target.lp"], GIVEN)
    assert not any(atom.startswith("aimed") for atom in none)


def test_ideal_regret_and_worst(knowledge: Knowledge) -> None:
    worth = "preference(b(1,1),7,1). preference(b(2,1),-3,1). preference(b(1,1),-5,2). "
    (atoms,) = models(knowledge, ["target.lp"], GIVEN + worth)
    assert {atom for atom in atoms if not atom.startswith("preference")} == {
        "ideal(1,7)",
        "ideal(2,-5)",
        "regret(b(1,1),1,0)",
        "regret(b(2,1),1,10)",
        "regret(b(1,1),2,0)",
        "worst(10)",
    }


@pytest.mark.parametrize(
    ("facts", "best"),
    [
        pytest.param(
            "preference(b(10,10),3,1). preference((b(2,2);b(2,10);b(10,2)),2,1).",
            "b(10,10)",
            id="minimize_regret",
        ),
        pytest.param(
            "preference((b(2,10);b(10,2)),3,1). preference((b(2,2);b(10,10)),1,1)."
            "preference(b(2,10),5,2). preference(b(10,2),6,2). preference(b(2,2),9,2).",
            "b(10,2)",
            id="minimize_regret-second_rank",
        ),
        pytest.param(
            "ignore_ap. preference(b(2,2),3,1). preference((b(10,2);b(2,10);b(10,10)),0,1)."
            "roi_distance(b(10,10),5). roi_distance((b(2,2);b(10,2);b(2,10)),6).",
            "b(10,10)",
            id="minimize_distance-ignore_ap",
        ),
        pytest.param(
            "preference(b(10,10),3,1). preference((b(2,2);b(2,10);b(10,2)),2,1)."
            "roi_distance(b(10,10),9). roi_distance((b(2,2);b(10,2);b(2,10)),0).",
            "b(10,10)",
            id="minimize_distance-not_otherwise",
        ),
        pytest.param(
            "preference((b(2,10);b(10,2)),3,1). preference((b(2,2);b(10,10)),1,1).",
            "b(2,10)",
            id="minimize_i_before_j",
        ),
        pytest.param(
            "preference((b(10,10);b(10,2)),3,1). preference((b(2,2);b(2,10)),1,1).",
            "b(10,2)",
            id="minimize_j",
        ),
    ],
)
def test_the_best_target(knowledge: Knowledge, facts: str, best: str) -> None:
    found = models(knowledge, ["target.lp"], GIVEN + FOUR + AIM + facts, best=True)
    assert [targets(atoms) for atoms in found] == [{f"target(psm1,{best})"}]


def test_a_plan_without_a_grasp_pays_nothing(knowledge: Knowledge) -> None:
    worth = "preference((b(2,2);b(10,2)),0,1). preference((b(2,10);b(10,10)),1,1). "
    (atoms,) = models(knowledge, ["target.lp"], GIVEN + FOUR + worth, best=True)
    assert targets(atoms) == set()
