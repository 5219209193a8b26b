"""What motion asks of a robot, whoever it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from fras_common.errors import FrasError
from fras_motion.kinematics import Joints

__all__ = ["Driver", "DriverFault", "Measured", "Setpoint"]


class DriverFault(FrasError):
    """A robot that does not do its part.

    Parameters
    ----------
    arm : str
        Which.
    whose : str
        The service that drives it, as `hold:<service>` names it.
    """

    arm: str
    whose: str


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

        Raises
        ------
        DriverFault
            It is not there, or not to be had.
        """
        ...

    def resume(self, setpoint: Setpoint, measured: Measured, tick: int) -> Measured:
        """Take an arm over from a process that is no more; it stays where it is.

        Parameters
        ----------
        setpoint : Setpoint
            What was last sent to it.
        measured : Measured
            What it did then.
        tick : int
            Of the trial.

        Returns
        -------
        Measured
            What it does now.

        Raises
        ------
        DriverFault
            It does not answer, or stands elsewhere.
        """
        ...

    def send(self, setpoint: Setpoint) -> None:
        """Have the arm follow a setpoint from now on; never waits.

        Parameters
        ----------
        setpoint : Setpoint
            What holds until the next one.
        """
        ...

    def measure(self, dt_s: float) -> Measured:
        """Let a tick pass.

        Parameters
        ----------
        dt_s : float
            Duration of the tick [s].

        Returns
        -------
        Measured
            The arm at the end of the tick.

        Raises
        ------
        DriverFault
            It does not answer, or does not follow.
        """
        ...
