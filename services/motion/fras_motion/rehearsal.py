"""The walk along a path before it is accepted."""

from __future__ import annotations

from collections.abc import Mapping

from fras_motion.drivers import Setpoint
from fras_motion.kinematics import ArmKinematics, Instrument
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
    others: Mapping[str, Instrument],
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
    others : mapping of str to Instrument
        Every other arm -> its instrument, which stands.

    Raises
    ------
    GateRefused
        The first step that fails a gate.
    Unreachable
        A point of the path is out of reach.
    """
    earlier, before = start, start
    tip_before = arm.forward(start.joints)
    instrument_before = arm.instrument(start.joints, tip_before)
    for stroke in strokes:
        for s in stroke.profile.positions:
            after = stroke.setpoint(s, before)
            tip_after = arm.forward(after.joints)
            instrument_after = arm.instrument(after.joints, tip_after)
            step = Step(
                dt_s=dt_s,
                before=before,
                after=after,
                tip_before=tip_before,
                tip_after=tip_after,
                orientation_xyzw=arm.tool_down_xyzw,
                instrument_before=instrument_before,
                instrument_after=instrument_after,
                others=others,
            )
            for gate in gates.values():
                gate(step, bounds)
            joint_accelerations(earlier, before, after, dt_s)
            earlier, before = before, after
            tip_before, instrument_before = tip_after, instrument_after
    joint_accelerations(earlier, before, before, dt_s)
