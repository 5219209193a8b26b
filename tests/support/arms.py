"""Arms made by hand: what one says, kinematics of our own, and a way to be led over a bus."""

from collections.abc import Sequence
from math import cos, pi, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fras_motion.kinematics import BASES_IN_WORLD, HOME_TIPS_M, ArmKinematics
from fras_motion.parameters import MotionParameters
from fras_motion.robots import home_setpoints

KINEMATICS = {name: ArmKinematics(base) for name, base in BASES_IN_WORLD.items()}
HOME = home_setpoints(KINEMATICS, HOME_TIPS_M, MotionParameters())

Matrix = NDArray[np.float64]

# reference/psm.md, modified DH: alpha, a, d, offset; the third joint is the insertion.
_DH = (
    (pi / 2, 0.0, 0.0, pi / 2),
    (-pi / 2, 0.0, 0.0, -pi / 2),
    (pi / 2, 0.0, 0.0, -0.4318),
    (0.0, 0.0, 0.4162, 0.0),
    (-pi / 2, 0.0, 0.0, -pi / 2),
    (-pi / 2, 0.0091, 0.0, -pi / 2),
)
_TOOL = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
# Arm -> turn of its base about the world's z, and its remote centre of motion (docs/reference).
_BASES = {"psm1": (pi / 2, (0.05, 0.0, 0.16)), "psm2": (-pi / 2, (0.05, 0.12, 0.16))}


def _transform(rotation: Matrix, position: Sequence[float]) -> Matrix:
    made = np.eye(4)
    made[:3, :3] = rotation
    made[:3, 3] = position
    return made


def _about_x(angle: float) -> Matrix:
    return np.array([[1, 0, 0], [0, cos(angle), -sin(angle)], [0, sin(angle), cos(angle)]])


def _about_z(angle: float) -> Matrix:
    return np.array([[cos(angle), -sin(angle), 0], [sin(angle), cos(angle), 0], [0, 0, 1]])


def tip_in_base(joints: Sequence[float]) -> Matrix:
    """Pose of the tip in the arm's base by the table of psm.md: T = Rx(alpha) Tx(a) Rz Tz."""
    pose = np.eye(4)
    for number, ((alpha, a, d, offset), q) in enumerate(zip(_DH, joints, strict=True)):
        theta, along = (0.0, d + offset + q) if number == 2 else (offset + q, d)
        pose = pose @ _transform(_about_x(alpha), (a, 0, 0))
        pose = pose @ _transform(_about_z(theta), (0, 0, along))
    return pose @ _transform(_TOOL, (0, 0, 0))


def tip_in_world(arm: str, joints: Sequence[float]) -> Matrix:
    """Pose of an arm's tip in the world, shape (4, 4)."""
    turn, centre = _BASES[arm]
    return _transform(_about_z(turn), centre) @ tip_in_base(joints)


def rotation_of(quaternion_xyzw: Sequence[float]) -> Matrix:
    """Rotation matrix of a unit quaternion."""
    x, y, z, w = quaternion_xyzw
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * skew + 2 * skew @ skew


def off(joints: Sequence[float], index: int, by: float) -> Any:
    """Return joints of which one is elsewhere."""
    changed = list(joints)
    changed[index] += by
    return tuple(changed)
