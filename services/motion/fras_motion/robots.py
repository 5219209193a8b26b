"""The robots that a trial moves: where they begin, and simulated ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from .drivers import Driver, Setpoint, SimulatedDriver
from .kinematics import ArmKinematics, Pose, Vector3
from .parameters import MotionParameters

__all__ = ["home_setpoints", "simulated_drivers"]


def home_setpoints(
    arms: Mapping[str, ArmKinematics],
    tips_m: Mapping[str, Vector3],
    parameters: MotionParameters,
) -> dict[str, Setpoint]:
    """Where each arm begins: its tip there, its tool down, its jaw open.

    Raises
    ------
    Unreachable
        An arm can't be at its home.
    """
    return {
        name: Setpoint(arm.inverse(Pose(tips_m[name], arm.tool_down_xyzw)), parameters.jaw_open_rad)
        for name, arm in arms.items()
    }


def simulated_drivers(parameters: MotionParameters, arms: Iterable[str]) -> dict[str, Driver]:
    """Make a simulated arm for each name, the noise of each its own."""
    p = parameters
    return {
        name: SimulatedDriver(
            p.driver_time_constant_s,
            p.driver_noise_rad,
            p.driver_noise_m,
            seed=p.driver_seed + number,
            delay_s=p.driver_delay_s,
        )
        for number, name in enumerate(arms)
    }
