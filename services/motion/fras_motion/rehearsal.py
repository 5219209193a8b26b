"""The walk along a path before it is accepted."""

from __future__ import annotations

from collections.abc import Mapping

from fras_motion.drivers import Setpoint
from fras_motion.kinematics import ArmKinematics
from fras_motion.safety import Bounds, Gate, Step, joint_accelerations

from .strokes import Stroke

__all__ = ["rehearse"]


def rehearse(
    strokes: tuple[Stroke, ...],
    start: Setpoint,
    arm: ArmKinematics,
    dt_s: float,
    gates: Mapping[str, Gate],
    bounds: Bounds,
) -> None:
    """Send every setpoint of a path through the gates, as it will be sent.

    Parameters
    ----------
    strokes : tuple of Stroke
        The path.
    start : Setpoint
        Where the arm stands, at rest.
    arm : ArmKinematics
        The arm.
    dt_s : float
        Duration of a tick [s].
    gates : mapping of str to Gate
        What each step has to pass.
    bounds : Bounds
        What the gates hold it against.

    Raises
    ------
    GateRefused
        The first step that fails a gate.
    Unreachable
        A point of the path is out of reach.
    """
    earlier, before = start, start
    tip_before = arm.forward(start.joints)
    for stroke in strokes:
        for s in stroke.profile.positions:
            after = stroke.setpoint(s, before)
            tip_after = arm.forward(after.joints)
            step = Step(dt_s, before, after, tip_before, tip_after, arm.tool_down_xyzw)
            for gate in gates.values():
                gate(step, bounds)
            joint_accelerations(earlier, before, after, dt_s)
            earlier, before, tip_before = before, after, tip_after
    joint_accelerations(earlier, before, before, dt_s)
