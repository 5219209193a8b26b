# pyright: reportMissingTypeStubs=false, reportMissingImports=false
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportAttributeAccessIssue=false
"""Instruments as capsules, and how far they are from things (this file alone sees coal)."""

from __future__ import annotations

from functools import lru_cache
from itertools import product
from math import dist, inf, isfinite, nan
from typing import Any, Final

import coal
import numpy as np

from fras_motion.kinematics import Instrument, Vector3

__all__ = ["JAW_RADIUS_M", "SHAFT_RADIUS_M", "box_distance_m", "instrument_distance_m"]

#: The instruments have a shaft of 8 mm.
SHAFT_RADIUS_M: Final = 0.004
#: The jaw's two fingers open to either side by half the jaw's angle, about a hinge at most 9.1 mm
#: from the tip (psm.md, joint 6): to 9.1 sin(80 deg / 2) = 5.9 mm at the jaw's limit. One radius
#: for every angle of the jaw, so that a release, which must always be possible, brings no capsule
#: nearer to anything.
JAW_RADIUS_M: Final = 0.006

_REQUEST = coal.DistanceRequest()
_RESULT = coal.DistanceResult()


def instrument_distance_m(one: Instrument, other: Instrument) -> float:
    """Distance between the surfaces of two instruments.

    Parameters
    ----------
    one, other : Instrument
        The instruments.

    Returns
    -------
    float
        Smallest distance between a capsule of the one and one of the other [m]; negative where
        they overlap, not a number where an instrument's place is none.
    """
    return _least_distance_m(_capsules(one), _capsules(other))


def box_distance_m(instrument: Instrument, lower_m: Vector3, upper_m: Vector3) -> float:
    """Distance between the surfaces of an instrument and a box.

    Parameters
    ----------
    instrument : Instrument
        The instrument.
    lower_m, upper_m : tuple of float, length 3
        Corners of the box, world frame [m].

    Returns
    -------
    float
        Smallest distance between a capsule and the box [m]; negative where they overlap, not a
        number where the instrument's place is none.
    """
    return _least_distance_m(_capsules(instrument), (_box(lower_m, upper_m),))


def _capsules(instrument: Instrument) -> tuple[Any, ...]:
    return (
        _capsule(instrument.remote_centre_m, instrument.wrist_m, SHAFT_RADIUS_M),
        _capsule(instrument.wrist_m, instrument.tip_m, JAW_RADIUS_M),
    )


def _least_distance_m(some: tuple[Any, ...], others: tuple[Any, ...]) -> float:
    least = inf
    for one, other in product(some, others):
        if one is None or other is None:
            # A minimum would depend on where in the row the missing number stands.
            return nan
        _RESULT.clear()
        least = min(least, coal.distance(*one, *other, _REQUEST, _RESULT))
    return least


# What stands, and where the moving arm was a tick ago, is not made anew.
@lru_cache(maxsize=32)
def _capsule(start: Vector3, end: Vector3, radius_m: float) -> tuple[Any, Any] | None:
    """Make the shape and its placement: coal's capsules lie along z, about their middle."""
    length = dist(start, end)
    if not isfinite(length):
        return None
    middle = np.array([0.5 * (a + b) for a, b in zip(start, end, strict=True)])
    return coal.Capsule(radius_m, length), coal.Transform3s(_turned(start, end, length), middle)


def _turned(start: Vector3, end: Vector3, length: float) -> Any:
    """Build a rotation whose z axis points from start to end."""
    if length == 0.0:
        return np.eye(3)
    z = tuple((b - a) / length for a, b in zip(start, end, strict=True))
    # Across z: by the axis of the world that is farthest from it.
    across = (0.0, z[2], -z[1]) if abs(z[0]) < 0.7 else (-z[2], 0.0, z[0])
    norm = dist(across, (0.0, 0.0, 0.0))
    x = (across[0] / norm, across[1] / norm, across[2] / norm)
    y = (z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0])
    return np.array([x, y, z]).T


@lru_cache(maxsize=32)
def _box(lower_m: Vector3, upper_m: Vector3) -> tuple[Any, Any]:
    lower, upper = np.array(lower_m), np.array(upper_m)
    return coal.Box(*(upper - lower).tolist()), coal.Transform3s(np.eye(3), 0.5 * (lower + upper))
