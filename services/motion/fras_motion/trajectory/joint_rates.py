"""Path limits under which the joints keep their own limits."""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fras_motion.kinematics import JOINTS, ArmKinematics, Pose, Quaternion

from .line import Line
from .profile import Limits

__all__ = ["limits_for_slopes", "within_joint_rates"]

_SAMPLES = 33
# Between the samples the derivatives may be a little larger than at them.
_RESERVE = 0.95
# A joint that stands still on the way limits nothing.
_FLAT = 1e-9
_SPEEDS = np.array([joint.speed for joint in JOINTS])
_ACCELERATIONS = np.array([joint.acceleration for joint in JOINTS])


def within_joint_rates(
    arm: ArmKinematics, line: Line, orientation_xyzw: Quaternion, limits: Limits
) -> Limits:
    """Lower the limits along a line until the joints' speeds and accelerations allow them.

    Parameters
    ----------
    arm : ArmKinematics
        The arm that shall follow the line.
    line : Line
        The tip's path in the world; every point of it reachable.
    orientation_xyzw : tuple of float, length 4
        The tip's fixed orientation in the world.
    limits : Limits
        What is wished along the line [m/s, m/s^2, m/s^3].

    Returns
    -------
    Limits
        At most what was wished; the jerk is kept.

    Raises
    ------
    Unreachable
        A sampled point of the line is out of reach.

    Notes
    -----
    Along q(s): dq/dt = q' s', d2q/dt2 = q'' s'^2 + q' s''. With g and c the largest |q'| and
    |q''| of a joint over the line, s'^2 c is granted half of the joint's acceleration and s'' g
    what is left of it. q' = J^-1 (t, 0) with the line's direction t.
    """
    direction = np.zeros(6)
    direction[:3] = (np.array(line.end) - np.array(line.start)) / line.length
    arc = np.linspace(0.0, line.length, _SAMPLES)
    slopes = np.array(
        [
            np.linalg.solve(
                arm.jacobian(arm.inverse(Pose(line.point(float(s)), orientation_xyzw))), direction
            )
            for s in arc
        ]
    )
    return limits_for_slopes(slopes, float(arc[1]), limits, _RESERVE)


def limits_for_slopes(
    slopes: NDArray[np.floating[Any]], spacing: float, limits: Limits, reserve: float
) -> Limits:
    """Lower the limits along a path whose joints' derivatives are known at places of it.

    Parameters
    ----------
    slopes : ndarray, shape (n_places, 6), float64
        dq/ds of each joint [rad or m per path unit].
    spacing : float
        From a place to the next [path unit].
    limits : Limits
        What is wished along the path.
    reserve : float
        Share of the joints' limits that may be used: between the places more may be needed.

    Returns
    -------
    Limits
        At most what was wished; the jerk is kept. The formula: see `within_joint_rates`.
    """
    slope = np.maximum(np.abs(slopes).max(axis=0), _FLAT)
    curvature = np.maximum(np.abs(np.diff(slopes, axis=0)).max(axis=0) / spacing, _FLAT)
    speed = min(
        limits.speed,
        reserve * float((_SPEEDS / slope).min()),
        sqrt(0.5 * reserve * float((_ACCELERATIONS / curvature).min())),
    )
    left = reserve * _ACCELERATIONS - curvature * speed**2
    acceleration = min(limits.acceleration, float((left / slope).min()))
    return Limits(speed, acceleration, limits.jerk)
