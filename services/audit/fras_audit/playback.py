"""Arms of another process, as recorded: what they measured comes from the log."""

from fras_common.messages import RobotState
from fras_motion.drivers import DriverFault, Measured, Setpoint


class PlaybackDriver:
    """One arm; `load` has what it measures next.

    Parameters
    ----------
    arm : str
    at_rest : RobotState
        Of tick 0.
    """

    def __init__(self, arm: str, at_rest: RobotState) -> None:
        self._arm = arm
        self._next = _measured(at_rest, arm)
        self._faulty = False

    def load(self, state: RobotState, fault: bool) -> None:
        """Take what the arm measured at the tick of `state`; `fault`: an arm failed in it."""
        measured = _measured(state, self._arm)
        # An arm that failed measured nothing, so the state before it stands.
        self._faulty = fault and measured == self._next
        self._next = measured

    def reset(self, setpoint: Setpoint) -> Measured:
        """Return what it measured at tick 0."""
        del setpoint
        return self._next

    def resume(self, setpoint: Setpoint, measured: Measured, tick: int) -> Measured:
        """Return what it measured last."""
        del setpoint, tick
        self._next = measured
        return measured

    def send(self, setpoint: Setpoint) -> None:
        """Nothing follows: it has moved already."""

    def measure(self, dt_s: float) -> Measured:
        """Return what was loaded.

        Raises
        ------
        DriverFault
        """
        del dt_s
        if self._faulty:
            raise DriverFault("as recorded", arm=self._arm, whose="arms")
        return self._next


def playback_drivers(at_rest: RobotState) -> dict[str, PlaybackDriver]:
    """Make a driver for each arm of the state at tick 0."""
    return {arm: PlaybackDriver(arm, at_rest) for arm in at_rest.arms}


def _measured(state: RobotState, arm: str) -> Measured:
    said = state.arms[arm]
    return Measured(said.joints, said.joint_velocities, said.jaw_rad)
