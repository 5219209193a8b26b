"""Strokes: motions of one arm from rest to rest along one dimension."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

from fras_motion.drivers import Setpoint
from fras_motion.kinematics import ArmKinematics, Pose
from fras_motion.trajectory import Line, Profile

__all__ = ["JawStroke", "LineStroke", "Stroke"]


class Stroke(Protocol):
    """A motion from rest to rest along one dimension."""

    @property
    def phase(self) -> str:
        """Name of the action's phase."""
        ...

    @property
    def profile(self) -> Profile:
        """Its time scaling."""
        ...

    @property
    def stop_deceleration(self) -> float:
        """Limit of a stop [path unit/s^2]."""
        ...

    @property
    def can_retreat(self) -> bool:
        """Whether going back along it takes force off the tissue."""
        ...

    def setpoint(self, s: float, before: Setpoint) -> Setpoint:
        """Setpoint at a place of the path.

        Parameters
        ----------
        s : float
            Distance from the start [path unit].
        before : Setpoint
            The last setpoint.

        Returns
        -------
        Setpoint
            What to send.
        """
        ...


@dataclass(frozen=True)
class LineStroke:
    """The tip goes along a straight line, orientation and jaw fixed.

    Parameters
    ----------
    phase, profile, stop_deceleration
        See `Stroke`.
    line : Line
        The tip's path.
    arm : ArmKinematics
        The arm that goes.
    """

    phase: str
    profile: Profile
    stop_deceleration: float
    line: Line
    arm: ArmKinematics
    can_retreat: bool = True

    def setpoint(self, s: float, before: Setpoint) -> Setpoint:
        """Setpoint at a place of the line, see `Stroke.setpoint`.

        Parameters
        ----------
        s : float
            Distance from the start [m].
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
        tip = Pose(self.line.point(s), self.arm.tool_down_xyzw)
        return Setpoint(self.arm.inverse(tip, before.joints), before.jaw_rad)


@dataclass(frozen=True)
class JawStroke:
    """The jaw opens or closes, the arm stands.

    Parameters
    ----------
    phase, profile, stop_deceleration
        See `Stroke`.
    start_rad, end_rad : float
        The jaw at its ends.
    """

    phase: str
    profile: Profile
    stop_deceleration: float
    start_rad: float
    end_rad: float
    can_retreat: bool = False

    def setpoint(self, s: float, before: Setpoint) -> Setpoint:
        """Setpoint at a place of the way, see `Stroke.setpoint`.

        Parameters
        ----------
        s : float
            Angle from the start [rad], positive.
        before : Setpoint
            The last setpoint: the joints stay.

        Returns
        -------
        Setpoint
            What to send.
        """
        opening = self.end_rad > self.start_rad
        return replace(before, jaw_rad=self.start_rad + s if opening else self.start_rad - s)
