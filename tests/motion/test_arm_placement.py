from itertools import product

import numpy as np
import pytest
from benchmarks import psm_reference as reference

from fras_motion.kinematics import (
    BASES_IN_WORLD,
    HOME_TIPS_M,
    JOINTS,
    ArmKinematics,
    Pose,
    matrix,
)
from fras_motion.parameters import MotionParameters

LOWER = np.array([joint.lower for joint in JOINTS])
UPPER = np.array([joint.upper for joint in JOINTS])


def margins(arm, points):
    """Smallest distance of any joint to a limit, as a share of its range, over all points."""
    joints = np.array([arm.inverse(Pose(point, arm.tool_down_xyzw)) for point in points])
    return (np.minimum(joints - LOWER, UPPER - joints) / (UPPER - LOWER)).min(axis=0)


@pytest.mark.parametrize("name", sorted(BASES_IN_WORLD))
def test_whole_tissue_and_its_lift_are_reachable_tool_down(name):
    arm = ArmKinematics(BASES_IN_WORLD[name])
    grid = product(np.linspace(0, 0.1, 11), np.linspace(0, 0.12, 13), np.linspace(0, 0.065, 8))
    points = [(float(x), float(y), float(z)) for x, y, z in grid]
    assert margins(arm, points).min() > 0.1
    down = matrix(arm.tool_down_xyzw)
    np.testing.assert_allclose(down[:, 2], (0, 0, -1), atol=1e-12)


@pytest.mark.parametrize("name", sorted(BASES_IN_WORLD))
def test_whole_workspace_box_is_reachable_with_margin(name):
    arm = ArmKinematics(BASES_IN_WORLD[name])
    p = MotionParameters()
    axes = [
        np.linspace(lower, upper, 9)
        for lower, upper in zip(p.workspace_lower_m, p.workspace_upper_m, strict=True)
    ]
    points = [(float(x), float(y), float(z)) for x, y, z in product(*axes)]
    assert margins(arm, points).min() >= 0.08


def test_arms_stand_at_their_own_sides_with_their_tips_above_the_tissue():
    assert BASES_IN_WORLD["psm1"].position_m[1] < 0.06 < BASES_IN_WORLD["psm2"].position_m[1]
    assert HOME_TIPS_M == {"psm1": (0.05, 0.03, 0.06), "psm2": (0.05, 0.09, 0.06)}


@pytest.mark.parametrize("name", sorted(BASES_IN_WORLD))
def test_arms_stand_where_the_reference_says(name):
    base = BASES_IN_WORLD[name]
    position, turn = reference.BASES[name]
    assert base.position_m == position
    c, s = np.cos(turn), np.sin(turn)
    np.testing.assert_allclose(
        matrix(base.quaternion_xyzw), [[c, -s, 0], [s, c, 0], [0, 0, 1]], atol=1e-15
    )
    down = matrix(ArmKinematics(base).tool_down_xyzw)
    np.testing.assert_allclose(down, reference.tool_down(name), atol=1e-15)
