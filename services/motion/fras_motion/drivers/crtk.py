"""An arm that another process drives, reached under the keys of CRTK."""

from __future__ import annotations

from typing import Protocol

from fras_motion.kinematics import JOINT_NAMES

from .base import DriverFault, Measured, Setpoint

__all__ = ["ArmsLink", "CrtkDriver"]

# How far from its home an arm may stand when a trial begins, where the first tick takes it.
_AT_HOME_RAD = 2e-3
_AT_HOME_M = 1e-3
_TOLERANCES = (_AT_HOME_RAD, _AT_HOME_RAD, _AT_HOME_M, _AT_HOME_RAD, _AT_HOME_RAD, _AT_HOME_RAD)
_AT_HOME_JAW_RAD = 0.05
# How far an arm may lag behind what was sent to it: ten times what servos do at planned speeds.
_LAG_RAD = 0.15
_LAG_M = 0.015
_LAG_JAW_RAD = 0.8
_LAGS = (_LAG_RAD, _LAG_RAD, _LAG_M, _LAG_RAD, _LAG_RAD, _LAG_RAD)


class ArmsLink(Protocol):
    """The way to the process that drives the arms."""

    def listen(self, arm: str) -> None:
        """Forget what an arm has said until now."""
        ...

    def send(self, arm: str, setpoint: Setpoint) -> None:
        """Send `servo_jp` and `jaw/servo_jp`, then listen anew; never waits."""
        ...

    def measured(self, arm: str) -> Measured | None:
        """Wait for the first that an arm has measured since; None if nothing comes in time."""
        ...


class CrtkDriver:
    """One arm of another process.

    Parameters
    ----------
    arm : str
        Its name.
    link : ArmsLink
        The way to it.

    Notes
    -----
    Nothing here waits for a clock: a tick ends with the first measurement after its setpoint. The
    arms move in real time, so trials with them run at pace 1 at most, and no two are equal bit for
    bit.
    """

    def __init__(self, arm: str, link: ArmsLink) -> None:
        self._arm = arm
        self._link = link
        self._sent: Setpoint | None = None

    def reset(self, setpoint: Setpoint) -> Measured:
        """Require the arm to stand where a trial begins: nothing moves it before a verdict does.

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
            It stands elsewhere, or does not say where.
        """
        self._sent = None
        self._link.listen(self._arm)
        measured = self._await()
        self._require_near(
            measured,
            setpoint,
            (*_TOLERANCES, _AT_HOME_JAW_RAD),
            "does not stand where a trial begins; bring it there first (move_cp)",
        )
        return measured

    def resume(self, setpoint: Setpoint, measured: Measured, tick: int) -> Measured:
        """Take over an arm that has stood at its last setpoint meanwhile.

        Parameters
        ----------
        setpoint, measured, tick
            See `Driver.resume`.

        Returns
        -------
        Measured
            The arm now.

        Raises
        ------
        DriverFault
            It stands elsewhere, or does not say where.
        """
        del measured, tick
        self._sent = setpoint
        self._link.listen(self._arm)
        now = self._await()
        text = "does not stand where it was last sent; somebody else has led it meanwhile"
        self._require_near(now, setpoint, (*_LAGS, _LAG_JAW_RAD), text)
        return now

    def send(self, setpoint: Setpoint) -> None:
        """Send a setpoint.

        Parameters
        ----------
        setpoint : Setpoint
            What to follow from now on.
        """
        self._sent = setpoint
        self._link.send(self._arm, setpoint)

    def measure(self, dt_s: float) -> Measured:
        """Take the first measurement after the setpoint was sent.

        Parameters
        ----------
        dt_s : float
            Not used: the arm has a clock of its own.

        Returns
        -------
        Measured
            The arm by then.

        Raises
        ------
        DriverFault
            It does not answer, or does not follow.
        """
        del dt_s
        measured = self._await()
        if self._sent is not None:
            text = "does not follow; see what its process refused (fault/arms)"
            self._require_near(measured, self._sent, (*_LAGS, _LAG_JAW_RAD), text)
        return measured

    def _require_near(
        self, measured: Measured, setpoint: Setpoint, tolerances: tuple[float, ...], text: str
    ) -> None:
        names = (*JOINT_NAMES, "jaw")
        are, shall = (*measured.joints, measured.jaw_rad), (*setpoint.joints, setpoint.jaw_rad)
        for joint, value, wanted, tolerance in zip(names, are, shall, tolerances, strict=True):
            if not abs(value - wanted) <= tolerance:
                raise DriverFault(
                    f"{self._arm} {text}: {joint} is {value:.4f}, shall be {wanted:.4f} within "
                    f"{tolerance:g}",
                    arm=self._arm,
                    whose="arms",
                    joint=joint,
                    value=value,
                    wanted=wanted,
                )

    def _await(self) -> Measured:
        measured = self._link.measured(self._arm)
        if measured is None:
            raise DriverFault(
                f"{self._arm} does not say where it is: does the process that drives it run?",
                arm=self._arm,
                whose="arms",
            )
        return measured
