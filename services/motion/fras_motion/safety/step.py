"""What a gate looks at: one step of one arm, and what it is held against."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from fras_motion.drivers import Setpoint
from fras_motion.kinematics import Instrument, Pose, Quaternion, Vector3

__all__ = ["Bounds", "Box", "Gate", "Step"]


@dataclass(frozen=True)
class Box:
    """A box along the axes of the world.

    Parameters
    ----------
    lower_m, upper_m : tuple of float, length 3
        Its corners [m].
    """

    lower_m: Vector3
    upper_m: Vector3


@dataclass(frozen=True)
class Bounds:
    """What the gates hold steps against, beside the arm's own limits.

    Parameters
    ----------
    workspace_lower_m, workspace_upper_m : tuple of float, length 3
        Corners of the box the tips must stay in, world frame [m].
    speed_m_s : float
        Largest speed of a tip.
    jaw_speed_rad_s : float
        Largest speed of a jaw.
    instrument_clearance_m : float
        Smallest distance between the surfaces of two instruments.
    forbidden_boxes : tuple of Box
        Where no part of an instrument may be.
    orientation_rad : float
        Largest angle between a tip's orientation and the fixed one.
    """

    workspace_lower_m: Vector3
    workspace_upper_m: Vector3
    speed_m_s: float
    jaw_speed_rad_s: float
    instrument_clearance_m: float = 0.0
    forbidden_boxes: tuple[Box, ...] = ()
    orientation_rad: float = 1e-6


@dataclass(frozen=True)
class Step:
    """One tick of one arm: from the last setpoint to the next.

    Parameters
    ----------
    dt_s : float
        Duration of the tick [s].
    before, after : Setpoint
        The two setpoints.
    tip_before, tip_after : Pose
        The tips that belong to them, by forward kinematics, in the world.
    orientation_xyzw : tuple of float, length 4
        The orientation the tip shall keep, in the world.
    instrument_before, instrument_after : Instrument
        The instrument's axis that belongs to the two setpoints.
    others : mapping of str to Instrument
        Every other arm -> its instrument at this tick; it stands while this arm moves.
    """

    dt_s: float
    before: Setpoint
    after: Setpoint
    tip_before: Pose
    tip_after: Pose
    orientation_xyzw: Quaternion
    instrument_before: Instrument
    instrument_after: Instrument
    others: Mapping[str, Instrument]


Gate = Callable[[Step, Bounds], None]
