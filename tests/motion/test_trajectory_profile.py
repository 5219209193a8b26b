from math import dist, inf, nan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fras_motion.kinematics import BASES_IN_WORLD, JOINTS, ArmKinematics, Pose
from fras_motion.trajectory import (
    Limits,
    Line,
    ProfileImpossible,
    brake,
    rest_to_rest,
    retreat,
    within_joint_rates,
)

DT = 0.02


def padded(profile):
    """Positions with the rest before and after."""
    return np.array([0.0] * 4 + list(profile.positions) + [profile.positions[-1]] * 4)


@given(st.floats(1e-6, 0.3), st.floats(0.005, 0.1), st.floats(0.05, 1.0), st.floats(1.0, 50.0))
@settings(max_examples=200, deadline=None)
def test_profile_obeys_speed_acceleration_and_jerk(distance, speed, acceleration, jerk):
    profile = rest_to_rest(distance, Limits(speed, acceleration, jerk), DT)
    s = padded(profile)
    assert profile.positions[-1] == distance
    assert profile.velocities[-1] == 0.0
    assert np.all(np.diff(s) >= -1e-12)
    for order, limit in ((1, speed), (2, acceleration), (3, jerk)):
        assert np.abs(np.diff(s, order)).max() <= limit * DT**order * (1 + 1e-6) + 1e-12
    assert np.abs(profile.velocities).max() <= speed * (1 + 1e-9)


def test_profile_is_the_fastest():
    # Without a jerk limit: ramps of v/a = 0.5 s over v^2/a = 0.05 m, the rest at full speed.
    profile = rest_to_rest(0.15, Limits(0.1, 0.2, inf), DT)
    assert len(profile.positions) == round((0.5 + 0.5 + 0.1 / 0.1) / DT)


@pytest.mark.parametrize("distance", [0.0, -0.1, nan, inf])
def test_profile_over_no_distance_is_refused(distance):
    with pytest.raises(ProfileImpossible):
        rest_to_rest(distance, Limits(0.05, 0.2, 4.0), DT)


@pytest.mark.parametrize("speed", [-1.0, nan])
def test_profile_with_senseless_limits_is_refused(speed):
    with pytest.raises(ProfileImpossible):
        rest_to_rest(0.1, Limits(speed, 0.2, 4.0), DT)


def test_profile_that_takes_longer_than_anyone_waits_is_refused():
    assert len(rest_to_rest(0.05, Limits(1e-4, 0.2, 4.0), DT).positions) > 25_000
    with pytest.raises(ProfileImpossible, match="100000 ticks"):
        rest_to_rest(0.05, Limits(1e-6, 0.2, 4.0), DT)


@given(st.floats(-0.05, 0.05))
def test_brake_rests_within_two_ticks_over_the_shortest_way(velocity):
    position, left = brake(0.0, velocity, 1.25, DT)
    if left != 0.0:
        assert abs(velocity) - abs(left) == pytest.approx(1.25 * DT)
        position, left = brake(position, left, 1.25, DT)
    assert left == 0.0
    assert position == pytest.approx(np.sign(velocity) * velocity**2 / 2.5, abs=1e-15)


@given(st.floats(0.0, 0.005), st.floats(0.005, 0.05), st.floats(0.2, 2.0))
@settings(deadline=None)
def test_retreat_ends_at_rest_exactly_at_its_floor(way, speed, acceleration):
    position, velocity, before = way, 0.0, 0.0
    for _ in range(500):
        last = position
        position, velocity = retreat(position, velocity, 0.0, speed, acceleration, DT)
        assert position >= 0.0
        assert last - position <= speed * DT * (1 + 1e-9)
        assert abs(velocity - before) <= acceleration * DT * (1 + 1e-6) + 1e-9
        before = velocity
        if velocity == 0.0:
            break
    assert velocity == 0.0
    assert position == pytest.approx(0.0, abs=1e-9)


def test_line_goes_from_end_to_end():
    line = Line((0.0, 0.0, 0.0), (0.03, 0.04, 0.0))
    assert line.length == pytest.approx(0.05)
    assert line.point(0.025) == pytest.approx((0.015, 0.02, 0.0))
    assert line.point(line.length) == line.end
    assert dist(line.point(0.01), line.start) == pytest.approx(0.01)


def test_joint_limits_slow_a_line_down_near_the_remote_centre():
    arm = ArmKinematics(BASES_IN_WORLD["psm1"])
    wished = Limits(0.2, 2.0, 1000.0)
    near = Line((0.0, 0.0, 0.09), (0.1, 0.0, 0.09))
    given_limits = within_joint_rates(arm, near, arm.tool_down_xyzw, wished)
    assert given_limits.speed < wished.speed
    assert given_limits.acceleration < wished.acceleration
    s = padded(rest_to_rest(near.length, given_limits, DT))
    joints = np.array([arm.inverse(Pose(near.point(float(x)), arm.tool_down_xyzw)) for x in s])
    for order, name in ((1, "speed"), (2, "acceleration")):
        limits = np.array([getattr(joint, name) for joint in JOINTS])
        reached = np.abs(np.diff(joints, order, axis=0)).max(axis=0) / DT**order / limits
        assert reached.max() <= 1.0
    # The reserve is small: the limit that binds is nearly used.
    assert reached.max() > 0.5


def test_slow_lines_keep_their_limits():
    arm = ArmKinematics(BASES_IN_WORLD["psm1"])
    wished = Limits(0.01, 0.02, 4.0)
    line = Line((0.0, 0.05, 0.01), (0.1, 0.05, 0.01))
    assert within_joint_rates(arm, line, arm.tool_down_xyzw, wished) == wished
