"""The gates: each looks at one step of an arm and refuses it by name, or lets it pass.

The path of an action is walked through all of them before the action is accepted, and each
setpoint again before it is sent.
"""

from __future__ import annotations

from math import dist, inf, isfinite

from fras_motion.drivers import Setpoint
from fras_motion.kinematics import JAW_LOWER_RAD, JAW_UPPER_RAD, JOINTS, Vector3

from .errors import GateRefused
from .step import Bounds, Step

__all__ = [
    "cartesian_speed",
    "check_workspace",
    "finite",
    "jaw_limits",
    "jaw_speed",
    "joint_accelerations",
    "joint_limits",
    "joint_speed",
    "orientation",
    "workspace",
]

# A motion at its limit may exceed it by the rounding of the arithmetic.
_ROUNDING = 1.0 + 1e-6


def finite(step: Step, bounds: Bounds) -> None:
    """Require finite numbers.

    Parameters
    ----------
    step, bounds
        The step to judge and what it is held against.

    Raises
    ------
    GateRefused
        NaN or infinity.
    """
    del bounds
    for joint, value in zip(JOINTS, step.after.joints, strict=True):
        if not isfinite(value):
            raise GateRefused("finite", joint.name, value, -inf, inf)
    if not isfinite(step.after.jaw_rad):
        raise GateRefused("finite", "jaw [rad]", step.after.jaw_rad, -inf, inf)


def joint_limits(step: Step, bounds: Bounds) -> None:
    """Keep every joint inside its range.

    Parameters
    ----------
    step, bounds
        The step to judge and what it is held against.

    Raises
    ------
    GateRefused
        A joint beyond its range.
    """
    del bounds
    for joint, value in zip(JOINTS, step.after.joints, strict=True):
        if not joint.lower <= value <= joint.upper:
            raise GateRefused("joint_limits", joint.name, value, joint.lower, joint.upper)


def joint_speed(step: Step, bounds: Bounds) -> None:
    """Keep every joint as slow as it has to be.

    Parameters
    ----------
    step, bounds
        The step to judge and what it is held against.

    Raises
    ------
    GateRefused
        A joint too fast, for instance a jump.
    """
    del bounds
    for joint, a, b in zip(JOINTS, step.before.joints, step.after.joints, strict=True):
        speed = (b - a) / step.dt_s
        if not abs(speed) <= joint.speed * _ROUNDING:
            raise GateRefused(
                "joint_speed", f"rate of {joint.name}", speed, -joint.speed, joint.speed
            )


def jaw_limits(step: Step, bounds: Bounds) -> None:
    """Keep the jaw inside its range.

    Parameters
    ----------
    step, bounds
        The step to judge and what it is held against.

    Raises
    ------
    GateRefused
        The jaw beyond its range.
    """
    del bounds
    jaw = step.after.jaw_rad
    if not JAW_LOWER_RAD <= jaw <= JAW_UPPER_RAD:
        raise GateRefused("jaw_limits", "jaw [rad]", jaw, JAW_LOWER_RAD, JAW_UPPER_RAD)


def jaw_speed(step: Step, bounds: Bounds) -> None:
    """Keep the jaw as slow as it has to be.

    Parameters
    ----------
    step, bounds
        The step to judge and what it is held against.

    Raises
    ------
    GateRefused
        The jaw too fast.
    """
    speed, limit = (step.after.jaw_rad - step.before.jaw_rad) / step.dt_s, bounds.jaw_speed_rad_s
    if not abs(speed) <= limit * _ROUNDING:
        raise GateRefused("jaw_speed", "rate of the jaw [rad/s]", speed, -limit, limit)


def workspace(step: Step, bounds: Bounds) -> None:
    """Keep the tip inside the box.

    Parameters
    ----------
    step, bounds
        The step to judge and what it is held against.

    Raises
    ------
    GateRefused
        The tip outside of the box.
    """
    check_workspace(step.tip_after.position_m, bounds)


def cartesian_speed(step: Step, bounds: Bounds) -> None:
    """Keep the tip as slow as it has to be.

    Parameters
    ----------
    step, bounds
        The step to judge and what it is held against.

    Raises
    ------
    GateRefused
        The tip too fast, for instance a jump.
    """
    speed = dist(step.tip_before.position_m, step.tip_after.position_m) / step.dt_s
    if not speed <= bounds.speed_m_s * _ROUNDING:
        raise GateRefused("cartesian_speed", "speed of the tip [m/s]", speed, 0.0, bounds.speed_m_s)


def orientation(step: Step, bounds: Bounds) -> None:
    """Keep the tip's orientation.

    Parameters
    ----------
    step, bounds
        The step to judge and what it is held against.

    Raises
    ------
    GateRefused
        The tip turned.

    Notes
    -----
    The vector part of the relative quaternion has the length sin(angle / 2); unlike the scalar
    part's arc cosine it resolves small angles.
    """
    ax, ay, az, aw = step.orientation_xyzw
    bx, by, bz, bw = step.tip_after.quaternion_xyzw
    angle = 2.0 * dist(
        (aw * bx + ay * bz, aw * by + az * bx, aw * bz + ax * by),
        (ax * bw + az * by, ay * bw + ax * bz, az * bw + ay * bx),
    )
    if not angle <= bounds.orientation_rad:
        raise GateRefused(
            "orientation", "turn of the tip [rad]", angle, 0.0, bounds.orientation_rad
        )


def check_workspace(tip_m: Vector3, bounds: Bounds) -> None:
    """Refuse a point outside of the box.

    Parameters
    ----------
    tip_m : tuple of float, length 3
        A point in the world [m].
    bounds : Bounds
        Holds the box.

    Raises
    ------
    GateRefused
        Names the first coordinate outside of the box.
    """
    for axis, value, lower, upper in zip(
        "xyz", tip_m, bounds.workspace_lower_m, bounds.workspace_upper_m, strict=True
    ):
        if not lower <= value <= upper:
            raise GateRefused("workspace", f"{axis} of the tip [m]", value, lower, upper)


def joint_accelerations(first: Setpoint, second: Setpoint, third: Setpoint, dt_s: float) -> None:
    """Refuse a planned motion in which a joint accelerates more than it can.

    A stop has its own limit (design, section 8), so this one is for plans only and not among
    `GATES`.

    Parameters
    ----------
    first, second, third : Setpoint
        Three setpoints in a row.
    dt_s : float
        Duration of a tick [s].

    Raises
    ------
    GateRefused
        A joint accelerates too much.
    """
    for joint, a, b, c in zip(JOINTS, first.joints, second.joints, third.joints, strict=True):
        value, limit = (c - 2.0 * b + a) / dt_s**2, joint.acceleration
        if not abs(value) <= limit * _ROUNDING:
            raise GateRefused(
                "joint_acceleration", f"acceleration of {joint.name}", value, -limit, limit
            )
