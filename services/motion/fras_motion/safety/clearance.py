"""The gates that keep an instrument away from the other one and out of forbidden boxes.

Two instruments that are too near already, or an instrument in a box, must be able to leave: a step
that brings nothing nearer passes, so that no pair of arms locks itself for ever.
"""

from __future__ import annotations

from math import inf

from .capsules import box_distance_m, instrument_distance_m
from .errors import GateRefused
from .step import Bounds, Step

__all__ = ["forbidden_box", "instrument_distance"]


def instrument_distance(step: Step, bounds: Bounds) -> None:
    """Keep the instruments apart.

    Parameters
    ----------
    step, bounds
        The step to judge and what it is held against.

    Raises
    ------
    GateRefused
        Nearer to another instrument than the clearance, and nearer than before.
    """
    clearance = bounds.instrument_clearance_m
    for name, other in step.others.items():
        distance = instrument_distance_m(step.instrument_after, other)
        if distance >= clearance:
            continue
        if not distance >= instrument_distance_m(step.instrument_before, other):
            raise GateRefused(
                "instrument_distance", f"distance to {name} [m]", distance, clearance, inf
            )


def forbidden_box(step: Step, bounds: Bounds) -> None:
    """Keep the instrument out of the boxes that the scenario forbids.

    Parameters
    ----------
    step, bounds
        The step to judge and what it is held against.

    Raises
    ------
    GateRefused
        In a box, and deeper than before.
    """
    for box in bounds.forbidden_boxes:
        distance = box_distance_m(step.instrument_after, box.lower_m, box.upper_m)
        if distance >= 0.0:
            continue
        if not distance >= box_distance_m(step.instrument_before, box.lower_m, box.upper_m):
            place = f"distance to the box {box.lower_m} .. {box.upper_m} [m]"
            raise GateRefused("forbidden_box", place, distance, 0.0, inf)
