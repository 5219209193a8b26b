from itertools import accumulate

import pytest

from fras_motion.drivers import Setpoint
from fras_motion.kinematics import BASES_IN_WORLD, ArmKinematics, Pose
from fras_motion.parameters import MotionParameters
from fras_motion.rehearsal import rehearse
from fras_motion.safety import GATES, GateRefused
from fras_motion.strokes import LineStroke
from fras_motion.trajectory import Limits, Line, Profile, rest_to_rest

ARM = ArmKinematics(BASES_IN_WORLD["psm1"])
LINE = Line((0.02, 0.03, 0.06), (0.02, 0.03, 0.02))
START = Setpoint(ARM.inverse(Pose(LINE.start, ARM.tool_down_xyzw)), 1.0)
BOUNDS = MotionParameters().bounds


def walk(profile):
    rehearse((LineStroke("lift", profile, 1.25, LINE, ARM),), START, ARM, 0.02, GATES, BOUNDS, {})


def test_planned_line_passes():
    walk(rest_to_rest(LINE.length, Limits(0.05, 0.2, 4.0), 0.02))


def test_line_that_starts_with_a_jerk_is_refused():
    steps = [0.001 - 0.00005 * tick for tick in range(21)]
    with pytest.raises(GateRefused, match="joint_acceleration"):
        walk(Profile(tuple(accumulate(steps)), (0.0,) * 21))


def test_line_that_ends_with_a_jerk_is_refused():
    gentle = tuple(0.5 * 0.15 * (0.02 * tick) ** 2 for tick in range(1, 16))
    with pytest.raises(GateRefused, match="joint_acceleration"):
        walk(Profile(gentle, (0.0,) * 15))


def test_jump_is_refused():
    with pytest.raises(GateRefused, match="joint_speed"):
        walk(Profile((0.04,), (0.0,)))
