"""What counts as equal: every bit, or numbers within a tolerance; and how a difference is named."""

import math
from typing import Any

import msgspec
import numpy as np
import pytest

from fras_audit.comparison import Tally, Tolerance, leaves
from fras_common.messages import Array, HoldState, JawState, SimCheckpoint
from fras_common.scenario import PatientSection, Scenario


def jaw(jaw_rad: float, **header: Any) -> JawState:
    return JawState(jaw_rad=jaw_rad, **header)


def array(*values: float) -> Array:
    return Array.of(np.array(values).reshape(-1, 3), "<f8")


def checkpoint(*nodes: float) -> SimCheckpoint:
    return SimCheckpoint(
        nodes_m=array(*nodes),
        velocity_m_s=array(0.0, 0.0, 0.0),
        support_n=array(0.0, 0.0, 0.0),
        balance_residual_n=0.0,
        arms={},
        settling=False,
    )


def test_what_the_publisher_fills_in_does_not_count() -> None:
    tally = Tally("motion", "jaws", 1)
    sent = jaw(0.5, stamp_ns=7, seq=3, source="motion/1", tick=4)
    assert tally.compare_messages("tick 4", sent, jaw(0.5, tick=4))
    assert (tally.seen, tally.equal, tally.skipped, tally.is_clean) == (1, 1, 0, True)


def test_the_tick_counts() -> None:
    tally = Tally("motion", "jaws", 1)
    assert not tally.compare_messages("tick 4", jaw(0.5, tick=4, seq=9), jaw(0.5, tick=5))
    assert tally.first is not None
    assert (tally.first.path, tally.first.recorded, tally.first.derived) == ("tick", 4, 5)
    assert tally.first.seq == 9


@pytest.mark.parametrize(
    ("recorded", "derived", "equal"),
    [
        (math.nan, math.nan, True),
        (0.0, -0.0, False),
        (1.0, math.nextafter(1.0, 2.0), False),
        (math.inf, math.inf, True),
        (math.nan, 1.0, False),
    ],
)
def test_a_number_is_equal_by_its_bits(recorded: float, derived: float, equal: bool) -> None:
    assert Tally("motion", "jaws", 1).compare("now", jaw(recorded), jaw(derived)) is equal
    nodes = checkpoint(recorded, 0.0, 0.0), checkpoint(derived, 0.0, 0.0)
    assert Tally("sim", "checkpoints", 1).compare("now", *nodes) is equal


def test_a_place_in_an_array_is_named() -> None:
    found = list(leaves(checkpoint(*range(6)), checkpoint(0, 1, 2, 3, 4, 9)))
    assert found == [("nodes_m[1][2]", 5.0, 9.0)]
    other_shape = list(leaves(checkpoint(*range(6)), checkpoint(*range(3))))
    assert other_shape == [("nodes_m", "<f8 (2, 3)", "<f8 (1, 3)")]


def test_a_missing_entry_is_named() -> None:
    held = HoldState(holds={"cli": "stop", "page": "stop"}, tick=4)
    assert list(leaves(held, HoldState(holds={"page": "stop"}, tick=4))) == [
        ("holds.cli", "stop", "nothing")
    ]
    assert list(leaves([1, 2], [1, 2, 3])) == [("[2]", "nothing", 3)]
    assert list(leaves({"a": [1.0, (2.0,)]}, {"a": [1.0, (3.0,)]})) == [("a[1][0]", 2.0, 3.0)]


def test_numbers_within_a_tolerance_are_counted_apart() -> None:
    tolerance = Tolerance(1e-9, {"nodes_m": 1e-3, "balance_residual_n": math.inf})
    tally = Tally("sim", "checkpoints", 3, tolerance)
    other = msgspec.structs.replace(checkpoint(1.0005, 0.0, 0.0), balance_residual_n=7.0)
    assert tally.compare("tick 1", checkpoint(1.0, 0.0, 0.0), other)
    assert not tally.compare("tick 2", checkpoint(1.0, 0.0, 0.0), checkpoint(1.002, 0.0, 0.0))
    assert (tally.equal, tally.tolerated, tally.differences, tally.skipped) == (1, 1, 1, 1)
    assert tally.first is not None
    assert tally.first.path == "nodes_m[0][0]"


@pytest.mark.parametrize(
    ("recorded", "derived"), [("ok", "soft"), (True, False), (None, 1.0), (math.nan, 1.0)]
)
def test_no_tolerance_admits_what_is_no_matter_of_digits(recorded: Any, derived: Any) -> None:
    assert not Tolerance(1e-3).admits("level", recorded, derived)


def test_what_is_not_looked_at_is_admitted_whatever_it_is() -> None:
    tolerance = Tolerance(1e-9, {"solver.refactored": math.inf})
    assert tolerance.admits("solver.refactored", True, False)
    assert not tolerance.admits("solver.converged", True, False)


def test_what_is_missing_and_what_is_too_much_are_differences() -> None:
    tally = Tally("sa", "verdicts", 1)
    tally.lacks("tick 3", "a verdict")
    tally.surplus("tick 4", "another", 12)
    assert (tally.compared, tally.differences, tally.seen) == (2, 2, 1)
    assert tally.first is not None
    assert (tally.first.where, tally.first.recorded) == ("tick 3", "nothing")


def test_a_field_that_is_left_out_equals_itself_and_nothing_else():
    with_one = Scenario(patient=PatientSection())
    assert list(leaves(Scenario(), Scenario())) == []
    ((path, recorded, derived),) = leaves(Scenario(), with_one)
    assert (path, recorded, derived) == ("patient", msgspec.UNSET, with_one.patient)
