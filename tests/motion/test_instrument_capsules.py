"""The distances that coal gives are those of geometry, and cost next to nothing."""

from math import nan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fras_motion.kinematics import BASES_IN_WORLD, ArmKinematics, Instrument
from fras_motion.kinematics.psm import JOINTS
from fras_motion.safety import (
    JAW_RADIUS_M,
    SHAFT_RADIUS_M,
    box_distance_m,
    instrument_distance_m,
)

ARM = ArmKinematics(BASES_IN_WORLD["psm1"])
points = st.tuples(*[st.floats(-0.1, 0.1).map(lambda x: round(x, 4))] * 3)
instruments = st.builds(Instrument, points, points, points)
boxes = st.tuples(points, st.tuples(*[st.floats(0.001, 0.1)] * 3))
joints = st.tuples(*[st.floats(joint.lower, joint.upper) for joint in JOINTS])


def legs(instrument):
    """Both capsules, as their ends and radius."""
    centre, wrist, tip = (
        np.array(point)
        for point in (instrument.remote_centre_m, instrument.wrist_m, instrument.tip_m)
    )
    return (centre, wrist, SHAFT_RADIUS_M), (wrist, tip, JAW_RADIUS_M)


def segment_distance(p, q, r, s):
    """Distance of two segments: the least of a convex function on the unit square."""
    d, e, w = q - p, s - r, p - r
    a, b, c, f, g = d @ d, d @ e, e @ e, d @ w, e @ w
    candidates = [(t, np.clip((g + b * t) / c if c else 0.0, 0.0, 1.0)) for t in (0.0, 1.0)] + [
        (np.clip((b * u - f) / a if a else 0.0, 0.0, 1.0), u) for u in (0.0, 1.0)
    ]
    if (det := a * c - b * b) > 1e-18:
        t, u = (b * g - c * f) / det, (a * g - b * f) / det
        if 0 <= t <= 1 and 0 <= u <= 1:
            candidates.append((t, u))
    return min(float(np.linalg.norm(w + t * d - u * e)) for t, u in candidates)


def box_distance(p, q, lower, upper):
    """Distance of a segment from a box, on a fine raster of the segment."""
    line = p + np.linspace(0.0, 1.0, 2001)[:, None] * (q - p)
    return float(np.linalg.norm(line - np.clip(line, lower, upper), axis=1).min())


@given(instruments, instruments)
@settings(max_examples=300, deadline=None)
def test_distance_of_instruments_is_that_of_their_axes_less_the_radii(one, other):
    least = min(
        segment_distance(p, q, r, s) - i - j for p, q, i in legs(one) for r, s, j in legs(other)
    )
    assert instrument_distance_m(one, other) == pytest.approx(least, abs=1e-7)


@given(instruments, boxes)
@settings(max_examples=300, deadline=None)
def test_distance_of_a_box_is_that_of_the_axes_less_the_radii(instrument, corner_and_size):
    lower, size = (np.array(values) for values in corner_and_size)
    upper = lower + size
    least = min(box_distance(p, q, lower, upper) - r for p, q, r in legs(instrument))
    distance = box_distance_m(instrument, tuple(lower.tolist()), tuple(upper.tolist()))
    if all(box_distance(p, q, lower, upper) > 0.0 for p, q, _ in legs(instrument)):
        assert distance == pytest.approx(least, abs=1e-4)  # half of a step of the raster
    else:
        assert distance <= -SHAFT_RADIUS_M + 1e-5


@given(joints)
def test_axis_runs_through_the_remote_centre_the_wrist_and_the_tip(values):
    tip = ARM.forward(values)
    axis = ARM.instrument(values, tip)
    origins = ARM.joint_origins(values)
    assert axis.tip_m == tip.position_m
    np.testing.assert_allclose(axis.remote_centre_m, origins[0], atol=1e-12)
    np.testing.assert_allclose(axis.wrist_m, origins[4], atol=1e-12)
    bent = np.linalg.norm(np.subtract(axis.tip_m, axis.wrist_m))
    assert bent == pytest.approx(0.0091, abs=1e-9)
    shaft = np.linalg.norm(np.subtract(axis.wrist_m, axis.remote_centre_m))
    assert shaft == pytest.approx(values[2] - 0.0156, abs=1e-9)


@pytest.mark.parametrize("place", range(3))
def test_a_place_that_is_no_number_has_no_distance(place):
    axis = [(0.0, 0.0, 0.1), (0.0, 0.0, 0.01), (0.0, 0.0, 0.0)]
    here = Instrument(*axis)
    axis[place] = (0.0, nan, 0.0)
    lost = Instrument(*axis)
    assert np.isnan(instrument_distance_m(lost, here))
    assert np.isnan(instrument_distance_m(here, lost))
    assert np.isnan(box_distance_m(lost, (0, 0, 0), (1, 1, 1)))
