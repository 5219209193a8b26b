"""A straight line that turns as it goes, for `move_cp`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import acos, dist, sin, sqrt

import numpy as np

from fras_motion.drivers import Setpoint
from fras_motion.kinematics import ArmKinematics, Pose, Quaternion
from fras_motion.trajectory import Limits, Line, Profile, limits_for_slopes

__all__ = ["TurningStroke", "limits_along", "path_length", "slerp"]

# A turn by a radian counts as a way of this length: about that from the wrist to the tissue's edge.
_LEVER_M = 0.05
_SAMPLES = 33
# Between the samples the derivatives may be a little larger than at them.
_RESERVE = 0.9


def _angle(start: Quaternion, end: Quaternion) -> float:
    """Angle of the shorter turn from one orientation to another [rad]."""
    cosine = abs(sum(a * b for a, b in zip(start, end, strict=True)))
    return 2.0 * acos(min(1.0, cosine))


def path_length(start: Pose, end: Pose) -> float:
    """Length of the way between two poses [m]: the longer of the line and the turn."""
    turn = _LEVER_M * _angle(start.quaternion_xyzw, end.quaternion_xyzw)
    return max(dist(start.position_m, end.position_m), turn)


def slerp(start: Quaternion, end: Quaternion, share: float) -> Quaternion:
    """Orientation on the shorter turn from one to another (Shoemake, SIGGRAPH 1985).

    Parameters
    ----------
    start, end : tuple of float, length 4
        Unit quaternions, scalar last.
    share : float
        0 at the start, 1 at the end.

    Returns
    -------
    tuple of float, length 4
        Unit quaternion, scalar last.
    """
    cosine = sum(a * b for a, b in zip(start, end, strict=True))
    sign = -1.0 if cosine < 0.0 else 1.0
    half = acos(min(1.0, abs(cosine)))
    if half < 1e-9:
        first, second = 1.0 - share, share
    else:
        first, second = sin((1.0 - share) * half) / sin(half), sin(share * half) / sin(half)
    x, y, z, w = (first * a + sign * second * b for a, b in zip(start, end, strict=True))
    norm = sqrt(x * x + y * y + z * z + w * w)
    return (x / norm, y / norm, z / norm, w / norm)


@dataclass(frozen=True)
class TurningStroke:
    """The tip goes along a straight line and turns evenly on the way; the jaw stays.

    Parameters
    ----------
    profile : Profile
        Time scaling over `path_length`.
    stop_deceleration : float
        Limit of a stop [m/s^2 along the path].
    start, end : Pose
        The tip at both ends, in the world.
    arm : ArmKinematics
        The arm that goes.
    """

    profile: Profile
    stop_deceleration: float
    start: Pose
    end: Pose
    arm: ArmKinematics
    phase: str = "move"
    can_retreat: bool = False

    def setpoint(self, s: float, before: Setpoint) -> Setpoint:
        """Setpoint at a place of the path, see `fras_motion.strokes.Stroke.setpoint`.

        Parameters
        ----------
        s : float
            Distance from the start [m along the path].
        before : Setpoint
            The last setpoint: the roll stays near to its own, the jaw stays.

        Returns
        -------
        Setpoint
            What to send.

        Raises
        ------
        Unreachable
            The place is out of reach.
        """
        tip = _between(self.start, self.end, s / path_length(self.start, self.end))
        return replace(before, joints=self.arm.inverse(tip, before.joints))


def _between(start: Pose, end: Pose, share: float) -> Pose:
    if share >= 1.0:
        return end
    line = Line(start.position_m, end.position_m)
    turned = slerp(start.quaternion_xyzw, end.quaternion_xyzw, share)
    return Pose(line.point(share * line.length) if line.length else start.position_m, turned)


def limits_along(
    arm: ArmKinematics, start: Pose, end: Pose, before: Setpoint, wished: Limits
) -> Limits:
    """Lower the limits of a path until the joints' speeds and accelerations allow them.

    Parameters
    ----------
    arm : ArmKinematics
        The arm that goes.
    start, end : Pose
        The tip at both ends.
    before : Setpoint
        Where it starts, for the roll.
    wished : Limits
        What is wished along the path [m/s, m/s^2, m/s^3].

    Returns
    -------
    Limits
        At most what was wished.

    Raises
    ------
    Unreachable
        A sampled point of the path is out of reach.

    Notes
    -----
    As `fras_motion.trajectory.within_joint_rates`, with the derivatives of the joints along the
    path from differences of the sampled inverse kinematics.
    """
    length = path_length(start, end)
    joints = before.joints
    rows: list[tuple[float, ...]] = []
    for share in np.linspace(0.0, 1.0, _SAMPLES):
        joints = arm.inverse(_between(start, end, float(share)), joints)
        rows.append(joints)
    spacing = length / (_SAMPLES - 1)
    slopes = np.diff(np.array(rows), axis=0) / spacing
    return limits_for_slopes(slopes, spacing, wished, _RESERVE)
