"""What motion asks of a robot, whoever it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from fras_motion.kinematics import Joints

__all__ = ["Driver", "Measured", "Setpoint"]


@dataclass(frozen=True)
class Setpoint:
    """What an arm shall do (CRTK `servo_jp`, `jaw/servo_jp`).

    Parameters
    ----------
    joints : tuple of float, length 6
        Joint values [rad; m for the insertion].
    jaw_rad : float
        Opening of the jaw [rad].
    """

    joints: Joints
    jaw_rad: float


@dataclass(frozen=True)
class Measured:
    """What an arm does (CRTK `measured_js`, `jaw/measured_js`).

    Parameters
    ----------
    joints : tuple of float, length 6
        Joint values [rad; m for the insertion].
    joint_velocities : tuple of float, length 6
        Mean over the last tick [rad/s; m/s for the insertion].
    jaw_rad : float
        Opening of the jaw [rad].
    """

    joints: Joints
    joint_velocities: Joints
    jaw_rad: float


class Driver(Protocol):
    """One arm."""

    def reset(self, setpoint: Setpoint) -> Measured:
        """Bring the arm to rest at a setpoint.

        Parameters
        ----------
        setpoint : Setpoint
            Where a trial begins.

        Returns
        -------
        Measured
            The arm at tick 0.
        """
        ...

    def servo(self, setpoint: Setpoint, dt_s: float) -> Measured:
        """Follow a setpoint for one tick.

        Parameters
        ----------
        setpoint : Setpoint
            What holds from now to the end of the tick.
        dt_s : float
            Duration of the tick [s].

        Returns
        -------
        Measured
            The arm at the end of the tick.
        """
        ...
