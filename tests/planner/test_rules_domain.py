"""The rules of domain.lp, one by one: facts in, atoms out."""

import pytest

from fras_planner.planning import Knowledge
from fras_planner.planning.program import Program
from planner.mutants import models

SIGNATURE = ("signature", ())
BLOCKS = "block(b(1,1)). block(b(1,2)). fixed(b(1,1)). "
GIVEN = "#defined target/2. " + BLOCKS

DECLARED = {
    "arm": {"psm1", "psm2"},
    "static": {"reachable(arm,block)", "fixed(block)", "above_roi(block)"},
    "sensed": {
        "at(arm,block)",
        "in_hand(arm,block)",
        "closed_gripper(arm)",
        "max_height(arm)",
        "visible_roi",
        "tried(block)",
        "rejected(block)",
        "barred(arm)",
    },
    "option": {"ignore_ap"},
    "action": {
        "reach(arm,block)",
        "grasp(arm,block)",
        "pull(arm,block)",
        "move(arm,block)",
        "release(arm)",
    },
}


@pytest.mark.parametrize("kind", DECLARED)
def test_signature(knowledge: Knowledge, kind: str) -> None:
    (atoms,) = models(knowledge, ["domain.lp"], GIVEN, [SIGNATURE])
    prefix = kind + "("
    assert {a[len(prefix) : -1] for a in atoms if a.startswith(prefix)} == DECLARED[kind]


@pytest.mark.parametrize(
    ("name", "arity", "instances"),
    [
        ("at", 2, 4),
        ("in_hand", 2, 4),
        ("closed_gripper", 1, 2),
        ("max_height", 1, 2),
        ("visible_roi", 0, 1),
        ("tried", 1, 2),
        ("rejected", 1, 2),
        ("barred", 1, 2),
        ("ignore_ap", 0, 1),
    ],
)
def test_external(knowledge: Knowledge, name: str, arity: int, instances: int) -> None:
    program = Program(knowledge, ["domain.lp"], ())
    program.ground(SIGNATURE, ("base", ()), facts=[GIVEN.strip(" .")])
    atoms = list(program.control.symbolic_atoms.by_signature(name, arity))
    assert len(atoms) == instances
    assert all(atom.is_external for atom in atoms)


@pytest.mark.parametrize(
    ("state", "expected", "absent"),
    [
        pytest.param("", "avoided(b(1,1))", "avoided(b(1,2))", id="avoided"),
        pytest.param("ignore_ap.", "", "avoided(b(1,1))", id="avoided-ignore_ap"),
        pytest.param("in_hand(psm1,b(1,1)).", "untried(psm1)", "untried(psm2)", id="untried"),
        pytest.param("in_hand(psm1,b(1,2)).", "wanted(psm1)", "wanted(psm2)", id="wanted"),
        pytest.param(
            "in_hand(psm1,b(1,2)). rejected(b(1,2)).",
            "untried(psm1)",
            "wanted(psm1) clean(psm1,b(1,2))",
            id="wanted-rejected",
        ),
        pytest.param(
            "in_hand(psm1,b(1,2)). barred(psm1).",
            "untried(psm1)",
            "wanted(psm1)",
            id="wanted-barred",
        ),
        pytest.param("in_hand(psm1,b(1,2)). tried(b(1,2)).", "", "wanted(psm1)", id="wanted-tried"),
        pytest.param(
            "in_hand(psm1,b(1,1)).", "wanted(psm1)", "clean(psm1,b(1,1))", id="wanted-avoided"
        ),
        pytest.param(
            "in_hand(psm1,b(1,1)). tried(b(1,1)).", "", "untried(psm1)", id="untried-tried"
        ),
        pytest.param(
            "in_hand(psm1,b(1,1)). in_hand(psm1,b(1,2)). tried(b(1,1)).",
            "untried(psm1)",
            "clean(psm1,b(1,1))",
            id="untried-one_of_two",
        ),
        pytest.param(
            "in_hand(psm1,b(1,1)). in_hand(psm1,b(1,2)).",
            "clean(psm1,b(1,2))",
            "clean(psm1,b(1,1)) clean(psm2,b(1,2))",
            id="clean",
        ),
        pytest.param(
            "in_hand(psm1,b(1,1)). ignore_ap.", "clean(psm1,b(1,1))", "", id="clean-ignore_ap"
        ),
        pytest.param(
            "in_hand(psm1,b(1,2)). tried(b(1,2)).", "", "clean(psm1,b(1,2))", id="clean-tried"
        ),
        pytest.param(
            "at(psm1,b(1,1)).",
            "at(start,psm1,1)",
            "at(start,psm2,1) at(target,psm1,1)",
            id="at_start",
        ),
        pytest.param(
            "at(psm1,b(1,2)). target(psm1,b(1,2)).",
            "at(target,psm1,1) at(start,psm1,1)",
            "at(target,psm2,1)",
            id="at_target",
        ),
        pytest.param(
            "at(psm1,b(1,1)). at(psm2,b(1,2)). target(psm1,b(1,2)).",
            "at(start,psm1,1) at(start,psm2,1)",
            "at(target,psm1,1) at(target,psm2,1)",
            id="at_target-elsewhere",
        ),
        pytest.param(
            "in_hand(psm2,b(1,1)).",
            "in_hand(start,psm2,1)",
            "in_hand(start,psm1,1) in_hand(target,psm2,1) closed_gripper(psm2,1)",
            id="in_hand",
        ),
        pytest.param(
            "closed_gripper(psm1).",
            "closed_gripper(psm1,1)",
            "closed_gripper(psm2,1) in_hand(start,psm1,1)",
            id="closed_gripper",
        ),
        pytest.param("max_height(psm2).", "max_height(psm2,1)", "max_height(psm1,1)", id="limit"),
        pytest.param("visible_roi.", "visible_roi(1)", "", id="visible_roi"),
        pytest.param(
            "", "", "visible_roi(1) max_height(psm1,1) closed_gripper(psm1,1)", id="nothing_sensed"
        ),
    ],
)
def test_rule(knowledge: Knowledge, state: str, expected: str, absent: str) -> None:
    (atoms,) = models(knowledge, ["domain.lp"], GIVEN + state, [SIGNATURE])
    assert set(expected.split()) <= atoms
    assert not set(absent.split()) & atoms
