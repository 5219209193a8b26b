"""Inverse kinematics of the PSM in closed form."""

from __future__ import annotations

from math import atan2, cos, hypot, pi, sin

from .errors import Unreachable
from .pose import Matrix, Vector3
from .psm import JOINTS

__all__ = ["Joints", "inverse"]

Joints = tuple[float, float, float, float, float, float]

_WRIST_LENGTH_M = JOINTS[5].a_m
_SHAFT_OFFSET_M = -(JOINTS[2].offset + JOINTS[3].d_m)
_ROLL = JOINTS[3]
_WRIST_PITCH = JOINTS[4]
_ROUNDING = 1e-12


def _dot(a: Vector3, b: Vector3) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _wrap(angle: float) -> float:
    """Bring an angle into (-pi, pi]."""
    return angle - 2 * pi * round(angle / (2 * pi))


def inverse(tip_in_base: Vector3, rotation_in_base: Matrix, near_roll: float = 0.0) -> Joints:
    """Joints that bring the tip to a pose.

    Parameters
    ----------
    tip_in_base : tuple of float, length 3
        Position of the tip in the arm's base frame [m].
    rotation_in_base : ndarray, shape (3, 3), float64
        Rotation of the tip in the arm's base frame.
    near_roll : float
        Of the values of the roll that differ by a full turn, the one nearest to this is
        returned [rad].

    Returns
    -------
    tuple of float, length 6
        The one solution inside the limits.

    Raises
    ------
    Unreachable
        No solution lies inside the limits; names the joint, its value and its bounds.

    Notes
    -----
    The tip p lies on the axis of the wrist's yaw, z6, at the distance l = 9.1 mm from the
    wrist's pitch axis: p = o + l x5 with x5 perpendicular to z6 and o, the wrist's centre, on the
    shaft, which passes through the RCM (the origin). The pitch axis z5 is perpendicular to the
    shaft, to x5 and to z6, hence 0 = o . (x5 x z6) = p . (x5 x z6): x5 is the direction of p's
    part perpendicular to z6. The opposite sign needs a wrist bent by more than 90 degrees.
    With o known, yaw, pitch and insertion follow from it, and the rest is
    R36 = Rz(q4) Ry(q5 - pi/2) Rz(pi/2 - q6) Rx(-pi), a ZYZ decomposition whose branch is fixed
    by |q5| < pi/2.
    """
    tip, rows = tip_in_base, rotation_in_base.tolist()
    # Columns of the last joint's frame, by the constant rotation from it to the tip.
    x6 = (-rows[0][1], -rows[1][1], -rows[2][1])
    y6 = (rows[0][2], rows[1][2], rows[2][2])
    z6 = (-rows[0][0], -rows[1][0], -rows[2][0])

    along = _dot(tip, z6)
    across = (tip[0] - along * z6[0], tip[1] - along * z6[1], tip[2] - along * z6[2])
    norm = hypot(*across)
    if norm < 1e-9:  # the wrist would have to be bent by a right angle
        raise Unreachable("wrist_pitch", pi / 2, _WRIST_PITCH.lower, _WRIST_PITCH.upper)
    scale = _WRIST_LENGTH_M / norm
    wrist = (tip[0] - scale * across[0], tip[1] - scale * across[1], tip[2] - scale * across[2])

    distance = hypot(*wrist)
    if not distance >= 1e-9:  # at the RCM itself, or not a number
        insertion = JOINTS[2]
        raise Unreachable("insertion", distance + _SHAFT_OFFSET_M, insertion.lower, insertion.upper)
    yaw = atan2(wrist[0], -wrist[2])
    pitch = atan2(-wrist[1], hypot(wrist[0], wrist[2]))

    s1, c1, s2, c2 = sin(yaw), cos(yaw), sin(pitch), cos(pitch)
    x3 = (-s1 * s2, -c2, c1 * s2)
    z3 = (s1 * c2, -s2, -c1 * c2)
    y3 = (
        z3[1] * x3[2] - z3[2] * x3[1],
        z3[2] * x3[0] - z3[0] * x3[2],
        z3[0] * x3[1] - z3[1] * x3[0],
    )
    x3z6, y3z6 = _dot(x3, z6), _dot(y3, z6)
    roll = _nearest_turn(atan2(y3z6, x3z6), near_roll)
    wrist_pitch = _wrap(atan2(-hypot(x3z6, y3z6), -_dot(z3, z6)) + pi / 2)
    wrist_yaw = _wrap(atan2(-_dot(z3, y6), _dot(z3, x6)) + pi / 2)

    return _into_limits((yaw, pitch, distance + _SHAFT_OFFSET_M, roll, wrist_pitch, wrist_yaw))


def _into_limits(joints: Joints) -> Joints:
    """Refuse joints beyond their limits; what is beyond by a rounding is brought to the limit."""
    inside: list[float] = []
    for joint, value in zip(JOINTS, joints, strict=True):
        if not joint.lower - _ROUNDING <= value <= joint.upper + _ROUNDING:
            raise Unreachable(joint.name, value, joint.lower, joint.upper)
        inside.append(min(max(value, joint.lower), joint.upper))
    yaw, pitch, insertion, roll, wrist_pitch, wrist_yaw = inside
    return (yaw, pitch, insertion, roll, wrist_pitch, wrist_yaw)


def _nearest_turn(roll: float, near: float) -> float:
    """Add full turns towards `near`, but never past the limits of the roll."""
    nearest = roll + 2 * pi * round((near - roll) / (2 * pi))
    # At its limit a roll may come out beyond it by a rounding: no reason for a full turn back.
    if _ROLL.lower - _ROUNDING <= nearest <= _ROLL.upper + _ROUNDING:
        return nearest
    return roll
