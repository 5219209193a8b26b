"""Plan monitoring: what was expected, whether it holds, and the numbers behind it."""

import itertools
import math

import numpy as np
import pytest

from fras_sa.awareness import (
    ArmView,
    Awareness,
    AwarenessParameters,
    Memory,
    RobotView,
    TissueView,
    UnknownAtom,
)

CLOSED = math.radians(20.0)
CENTRE = np.array([0.05, 0.06, 0.005])  # of b(4,4)


def above(height_m):
    return CENTRE + np.array([0.0, 0.0, height_m])


def situation(box, *, tip=CENTRE, jaw=-0.3, lift=0.0, max_height=()):
    """What `Awareness.context` takes; psm2 is far away with its jaw open."""
    model = box(fixed=[(0.01, 0.01, 0.0)])
    nodes = model.nodes_m + np.array([0.0, 0.0, lift])
    far = ArmView(np.array([0.0, 0.0, 0.3]), 1.0)
    robot = RobotView(0, {"psm1": ArmView(np.asarray(tip), jaw), "psm2": far})
    tissue = TissueView(0, nodes, 0.4, {}, converged=True)
    return Awareness(AwarenessParameters(), model), tissue, robot, Memory(frozenset(max_height))


def monitored(box, *expected, **options):
    sa, tissue, robot, memory = situation(box, **options)
    return sa.context(tissue, robot, memory, expected).monitored


@pytest.mark.parametrize(
    ("atom", "holds", "evidence"),
    [
        ("at(psm1,b(4,4))", False, {"distance_m": 0.0072, "at_distance_m": 0.005}),
        ("closed_gripper(psm1)", False, {"jaw_rad": 0.5, "closed_jaw_rad": CLOSED}),
        (
            "in_hand(psm1,b(4,4))",
            False,
            {
                "distance_m": 0.0072,
                "at_distance_m": 0.005,
                "jaw_rad": 0.5,
                "closed_jaw_rad": CLOSED,
            },
        ),
        ("-closed_gripper(psm1)", True, {"jaw_rad": 0.5, "closed_jaw_rad": CLOSED}),
        (
            "visible_roi",
            False,
            {
                "holds": 0.0,
                "visible_fraction": 0.0,
                "threshold_fraction": 0.7,
                "margin_fraction": -0.7,
            },
        ),
        (
            "max_height(psm1)",
            False,
            {
                "visible_fraction": 0.0,
                "threshold_fraction": 0.7,
                "force_n": 0.4,
                "limit_n": 0.5,
            },
        ),
        ("fixed(b(4,4))", False, {"fixed_points": 0.0}),
        ("fixed(b(1,1))", True, {"fixed_points": 1.0}),
        ("-fixed(b(1,1))", False, {"fixed_points": 1.0}),
        ("reachable(psm2,b(1,1))", False, {"rest_y_m": 0.06 / 7, "middle_y_m": 0.06}),
        (
            "above_roi(b(1,4))",
            False,
            {
                "roi_offset_x_m": 0.3 / 7,
                "roi_offset_y_m": 0.0,
                "half_cell_x_m": 0.05 / 7,
                "half_cell_y_m": 0.06 / 7,
            },
        ),
    ],
)
def test_numbers_are_told_whether_it_holds_or_not(box, atom, holds, evidence):
    (found,) = monitored(box, atom, tip=above(0.0072), jaw=0.5)
    assert (found.atom, found.holds) == (atom, holds)
    assert found.evidence == pytest.approx(evidence, abs=1e-12)


def test_the_distance_is_to_where_the_block_is_now(box):
    (found,) = monitored(box, "at(psm1,b(4,4))", lift=0.02)
    assert found.holds is False
    assert found.evidence["distance_m"] == pytest.approx(0.02, abs=1e-12)
    (held,) = monitored(box, "in_hand(psm1,b(4,4))", lift=0.02, tip=above(0.02))
    assert held.holds is True


@pytest.mark.parametrize(
    ("state", "some_hold"),
    [({"lift": 0.02, "max_height": ["psm2"]}, {"visible_roi"}), ({}, {"in_hand(psm1,b(4,4))"})],
)
def test_every_atom_agrees_with_the_context_and_shares_its_evidence(box, state, some_hold):
    sa, tissue, robot, memory = situation(box, **state)
    arms, blocks = ("psm1", "psm2"), sa.blocks.names
    atoms = [
        "visible_roi",
        *(f"{name}({arm})" for name in ("closed_gripper", "max_height") for arm in arms),
    ]
    atoms += [f"{name}({block})" for name in ("fixed", "above_roi") for block in blocks]
    for name, arm, block in itertools.product(("at", "in_hand", "reachable"), arms, blocks):
        atoms.append(f"{name}({arm},{block})")
    both = [*atoms, *(f"-{atom}" for atom in atoms)]
    context = sa.context(tissue, robot, memory, both)
    assert some_hold <= set(context.fluents) <= set(atoms)
    assert [one.atom for one in context.monitored[: len(atoms)]] == atoms
    for one in context.monitored:
        fluent = one.atom.removeprefix("-")
        assert one.holds == ((fluent in context.fluents) != one.atom.startswith("-"))
        assert one.evidence
        if fluent in context.fluents:
            assert one.evidence == context.evidence[fluent]


def test_nothing_asked_is_nothing_answered(box):
    assert monitored(box) == ()


@pytest.mark.parametrize(
    ("atom", "problem"),
    [
        ("at(psm1,b(8,1))", "unknown block 'b(8,1)'; known: b(1,1), "),
        ("-in_hand(psm3,b(1,1))", "unknown arm 'psm3'; known: psm1, psm2"),
        ("tried(b(1,1))", r"unknown fluent 'tried(b(1,1))'; known: at(arm,block), "),
        ("at(psm1)", "unknown fluent 'at(psm1)'; known: at(arm,block), "),
        ("visible_roi(psm1)", "unknown fluent 'visible_roi(psm1)'"),
        ("at(psm1,b(1,1)", "unknown "),
        ("--visible_roi", "unknown fluent '-visible_roi'"),
        ("", "unknown fluent ''"),
    ],
)
def test_what_the_scene_does_not_have_is_named_with_what_it_has(box, atom, problem):
    with pytest.raises(UnknownAtom) as error:
        monitored(box, "visible_roi", atom)
    assert f"{atom!r} can't be monitored: " in str(error.value)
    assert problem in str(error.value)
    assert error.value.values["atom"] == atom
    assert error.value.values["known"]
