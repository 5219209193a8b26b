"""The five actions as sequences of strokes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import dist

from fras_motion.drivers import Setpoint
from fras_motion.kinematics import ArmKinematics, Pose, Vector3
from fras_motion.safety import check_workspace
from fras_motion.trajectory import Limits, Line, rest_to_rest, within_joint_rates

from .errors import Refused
from .parameters import MotionParameters
from .states import Goal
from .strokes import JawStroke, LineStroke, Stroke

__all__ = ["PRIMITIVES", "Posture"]

# Corners of a path nearer than a tenth of the accuracy asked for are one.
_SAME_POINT_M = 1e-7


@dataclass(frozen=True)
class Posture:
    """Where an action starts: one arm at rest.

    Parameters
    ----------
    arm : ArmKinematics
        The arm.
    setpoint : Setpoint
        What was last sent to it.
    tip_m : tuple of float, length 3
        The tip that belongs to it, world frame [m].
    jaw_closed : bool
        Whether its jaw is measured closed.
    grasp_height_m : float or None
        Height of the tip when the jaw closed [m].
    """

    arm: ArmKinematics
    setpoint: Setpoint
    tip_m: Vector3
    jaw_closed: bool
    grasp_height_m: float | None


def _lines(
    corners: list[tuple[str, Vector3]],
    posture: Posture,
    speed_m_s: float,
    parameters: MotionParameters,
) -> tuple[Stroke, ...]:
    """Straight lines from the tip through the corners, each named by its phase."""
    strokes: list[Stroke] = []
    here = posture.tip_m
    wished = Limits(speed_m_s, parameters.acceleration_m_s2, parameters.jerk_m_s3)
    for phase, corner in corners:
        check_workspace(corner, parameters.bounds)
        # Refused here, the numbers are those of the corner and not of some point before it.
        posture.arm.inverse(Pose(corner, posture.arm.tool_down_xyzw))
        if dist(here, corner) < _SAME_POINT_M:
            continue
        line = Line(here, corner)
        limits = within_joint_rates(posture.arm, line, posture.arm.tool_down_xyzw, wished)
        profile = rest_to_rest(line.length, limits, parameters.dt_s)
        stroke = LineStroke(phase, profile, parameters.stop_deceleration_m_s2, line, posture.arm)
        strokes.append(stroke)
        here = corner
    return tuple(strokes)


def _jaw(
    phase: str, end_rad: float, posture: Posture, parameters: MotionParameters
) -> tuple[Stroke, ...]:
    start_rad = posture.setpoint.jaw_rad
    if start_rad == end_rad:
        return ()
    limits = Limits(parameters.jaw_speed_rad_s, parameters.jaw_acceleration_rad_s2)
    profile = rest_to_rest(abs(end_rad - start_rad), limits, parameters.dt_s)
    return (JawStroke(phase, profile, parameters.jaw_stop_deceleration_rad_s2, start_rad, end_rad),)


def _target(goal: Goal) -> Vector3:
    if goal.target_m is None:
        raise Refused(
            "target_missing",
            f"{goal.name} needs a target; ask situation awareness for it",
            action=goal.name,
        )
    return goal.target_m


def _needs_closed_jaw(goal: Goal, posture: Posture) -> float:
    if not posture.jaw_closed or posture.grasp_height_m is None:
        raise Refused(
            "jaw_open", f"{goal.name} needs the closed jaw of {goal.arm}; grasp first", arm=goal.arm
        )
    return posture.grasp_height_m


def _needs_open_jaw(goal: Goal, posture: Posture) -> None:
    if posture.jaw_closed:
        raise Refused(
            "jaw_closed",
            f"{goal.name} needs the open jaw of {goal.arm}; release first",
            arm=goal.arm,
        )


def reach(goal: Goal, posture: Posture, parameters: MotionParameters) -> tuple[Stroke, ...]:
    """Rise clear of the tissue, go above the target, come down on it.

    Parameters
    ----------
    goal, posture, parameters
        The goal, where its arm is, and the numbers of motion.

    Returns
    -------
    tuple of Stroke
        Empty when the tip is at the target.

    Raises
    ------
    Refused
        No target, or the jaw is closed.
    GateRefused, Unreachable, ProfileImpossible
        The path can't be followed.
    """
    _needs_open_jaw(goal, posture)
    target = _target(goal)
    x, y, z = posture.tip_m
    above = max(z, target[2] + parameters.clearance_height_m)
    corners: list[tuple[str, Vector3]] = [("descend", target)]
    if dist((x, y), target[:2]) >= _SAME_POINT_M:
        corners = [
            ("rise", (x, y, above)),
            ("traverse", (target[0], target[1], above)),
            *corners,
        ]
    return _lines(corners, posture, parameters.free_speed_m_s, parameters)


def grasp(goal: Goal, posture: Posture, parameters: MotionParameters) -> tuple[Stroke, ...]:
    """Close the jaw.

    Parameters
    ----------
    goal, posture, parameters
        The goal, where its arm is, and the numbers of motion.

    Returns
    -------
    tuple of Stroke
        One stroke of the jaw.

    Raises
    ------
    Refused
        The jaw is closed.
    """
    _needs_open_jaw(goal, posture)
    return _jaw("close", parameters.jaw_closed_rad, posture, parameters)


def release(goal: Goal, posture: Posture, parameters: MotionParameters) -> tuple[Stroke, ...]:
    """Open the jaw.

    Parameters
    ----------
    goal, posture, parameters
        The goal, where its arm is, and the numbers of motion.

    Returns
    -------
    tuple of Stroke
        One stroke of the jaw; empty when it is open.
    """
    del goal
    return _jaw("open", parameters.jaw_open_rad, posture, parameters)


def pull(goal: Goal, posture: Posture, parameters: MotionParameters) -> tuple[Stroke, ...]:
    """Lift the tissue to a height above that of the grasp, wherever the tip is by now.

    Parameters
    ----------
    goal, posture, parameters
        The goal, where its arm is, and the numbers of motion.

    Returns
    -------
    tuple of Stroke
        Empty when the tip is at that height.

    Raises
    ------
    Refused
        The jaw is open.
    GateRefused, Unreachable, ProfileImpossible
        The path can't be followed.
    """
    height = _needs_closed_jaw(goal, posture)
    x, y, _ = posture.tip_m
    top = (x, y, height + parameters.lift_height_m)
    return _lines([("lift", top)], posture, parameters.holding_speed_m_s, parameters)


def move(goal: Goal, posture: Posture, parameters: MotionParameters) -> tuple[Stroke, ...]:
    """Carry the tissue sideways, at the present height.

    Parameters
    ----------
    goal, posture, parameters
        The goal, where its arm is, and the numbers of motion.

    Returns
    -------
    tuple of Stroke
        Empty when the tip is there.

    Raises
    ------
    Refused
        No target, or the jaw is open.
    GateRefused, Unreachable, ProfileImpossible
        The path can't be followed.
    """
    _needs_closed_jaw(goal, posture)
    x, y, _ = _target(goal)
    # The target's height is that of the measured tip, which lags; the setpoint's is exact.
    there = (x, y, posture.tip_m[2])
    return _lines([("carry", there)], posture, parameters.holding_speed_m_s, parameters)


#: Every action, by name.
PRIMITIVES: dict[str, Callable[[Goal, Posture, MotionParameters], tuple[Stroke, ...]]] = {
    "reach": reach,
    "grasp": grasp,
    "release": release,
    "pull": pull,
    "move": move,
}
