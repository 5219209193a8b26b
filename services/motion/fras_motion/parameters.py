"""The numbers of motion, with the defaults of the design."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import inf, isfinite, radians

from fras_motion.kinematics import JAW_LOWER_RAD, JAW_UPPER_RAD, Vector3
from fras_motion.safety import Bounds, Box

from .errors import InvalidParameter

__all__ = ["MotionParameters"]

_MAY_BE_ZERO = (
    "driver_time_constant_s",
    "driver_delay_s",
    "driver_noise_rad",
    "driver_noise_m",
    "driver_seed",
)
_ANY_SIGN = ("jaw_open_rad", "jaw_closed_rad", "jaw_closed_below_rad")


@dataclass(frozen=True)
class MotionParameters:
    """Parameters of motion; invalid ones are refused when the object is made.

    Parameters
    ----------
    dt_s : float
        Duration of a tick.
    free_speed_m_s, holding_speed_m_s : float
        Speed of the tip with an open jaw, and with tissue in it.
    acceleration_m_s2, jerk_m_s3 : float
        Limits of planned motion of the tip.
    stop_deceleration_m_s2, jaw_stop_deceleration_rad_s2 : float
        Limits of a stop; they bring any planned speed to rest within two ticks.
    jaw_speed_rad_s, jaw_acceleration_rad_s2 : float
        Limits of planned motion of the jaw (the acceleration is that of the PSM's last joints).
    jaw_open_rad, jaw_closed_rad : float
        What opening and closing command.
    jaw_closed_below_rad : float
        A jaw is closed below this (the paper's 20 degrees).
    lift_height_m : float
        A pull ends this far above the height of the grasp.
    clearance_height_m : float
        A reach comes down on its target from at least this far above.
    settle_ticks : int
        Ticks at rest after a motion, before an action has succeeded.
    release_settle_speed_m_s : float
        A release has settled when all nodes are slower than this,
    release_settle_max_ticks : int
        or after this many ticks.
    retreat_max_m : float
        Longest retreat.
    retreat_force_ratio : float
        A retreat ends at this share of the force limit.
    driver_time_constant_s, driver_delay_s, driver_noise_rad, driver_noise_m, driver_seed
        The simulated arms, see `fras_motion.drivers.SimulatedDriver`; psm2 has the next seed.
    workspace_lower_m, workspace_upper_m : tuple of float, length 3
        Corners of the box the tips stay in, world frame.
    instrument_clearance_m : float
        Smallest distance between two instruments.
    forbidden_boxes : tuple of Box
        Where no part of an instrument may be, world frame.
    """

    dt_s: float = 0.02
    free_speed_m_s: float = 0.05
    holding_speed_m_s: float = 0.02
    acceleration_m_s2: float = 0.2
    jerk_m_s3: float = 4.0
    stop_deceleration_m_s2: float = 1.25
    jaw_speed_rad_s: float = 2.0
    jaw_acceleration_rad_s2: float = radians(720.0)
    jaw_stop_deceleration_rad_s2: float = 50.0
    jaw_open_rad: float = radians(60.0)
    jaw_closed_rad: float = radians(-20.0)
    jaw_closed_below_rad: float = radians(20.0)
    lift_height_m: float = 0.05
    clearance_height_m: float = 0.03
    settle_ticks: int = 5
    release_settle_speed_m_s: float = 1e-3
    release_settle_max_ticks: int = 100
    retreat_max_m: float = 0.005
    retreat_force_ratio: float = 0.95
    driver_time_constant_s: float = 0.01
    driver_delay_s: float = 0.0
    driver_noise_rad: float = 0.0
    driver_noise_m: float = 0.0
    driver_seed: int = 0
    workspace_lower_m: Vector3 = (-0.01, -0.01, -0.005)
    workspace_upper_m: Vector3 = (0.11, 0.13, 0.09)
    instrument_clearance_m: float = 0.002
    forbidden_boxes: tuple[Box, ...] = ()

    def __post_init__(self) -> None:
        for field in fields(self):
            if field.name == "forbidden_boxes":
                continue
            value: float | Vector3 = getattr(self, field.name)
            if isinstance(value, tuple):
                if not all(isfinite(coordinate) for coordinate in value):
                    raise InvalidParameter(field.name, value, "finite coordinates")
                continue
            if not isfinite(value):
                raise InvalidParameter(field.name, value, "a finite number")
            if field.name in _MAY_BE_ZERO and value < 0:
                raise InvalidParameter(field.name, value, "0 or greater")
            if field.name not in (*_MAY_BE_ZERO, *_ANY_SIGN) and value <= 0:
                raise InvalidParameter(field.name, value, "greater than 0")
        self._check_stops()
        self._check_jaw()
        if self.retreat_force_ratio > 1.0:
            raise InvalidParameter("retreat_force_ratio", self.retreat_force_ratio, "at most 1")
        if not _ordered(self.workspace_lower_m, self.workspace_upper_m):
            raise InvalidParameter(
                "workspace_upper_m", self.workspace_upper_m, "above workspace_lower_m on each axis"
            )
        for box in self.forbidden_boxes:
            if not _ordered(box.lower_m, box.upper_m):
                raise InvalidParameter(
                    "forbidden_boxes", box, "finite corners, upper_m above lower_m on each axis"
                )

    def _check_stops(self) -> None:
        two_ticks = 2.0 * self.dt_s * (1.0 + 1e-9)
        fastest = self.stop_deceleration_m_s2 * two_ticks
        for name in ("free_speed_m_s", "holding_speed_m_s"):
            speed: float = getattr(self, name)
            if speed > fastest:
                raise InvalidParameter(
                    name, speed, f"at most {fastest:.4g}, what the stop limit halts in two ticks"
                )
        fastest = self.jaw_stop_deceleration_rad_s2 * two_ticks
        if self.jaw_speed_rad_s > fastest:
            raise InvalidParameter("jaw_speed_rad_s", self.jaw_speed_rad_s, f"<= {fastest:.4g}")

    def _check_jaw(self) -> None:
        if not JAW_LOWER_RAD <= self.jaw_closed_rad < self.jaw_closed_below_rad:
            raise InvalidParameter(
                "jaw_closed_rad",
                self.jaw_closed_rad,
                f"{JAW_LOWER_RAD:.4f} .. jaw_closed_below_rad = {self.jaw_closed_below_rad:.4f}",
            )
        if not self.jaw_closed_below_rad < self.jaw_open_rad <= JAW_UPPER_RAD:
            raise InvalidParameter(
                "jaw_open_rad",
                self.jaw_open_rad,
                f"jaw_closed_below_rad = {self.jaw_closed_below_rad:.4f} .. {JAW_UPPER_RAD:.4f}",
            )

    @property
    def bounds(self) -> Bounds:
        """What the gates hold every setpoint against."""
        return Bounds(
            self.workspace_lower_m,
            self.workspace_upper_m,
            max(self.free_speed_m_s, self.holding_speed_m_s),
            self.jaw_speed_rad_s,
            self.instrument_clearance_m,
            self.forbidden_boxes,
        )


def _ordered(lower_m: Vector3, upper_m: Vector3) -> bool:
    pairs = zip(lower_m, upper_m, strict=True)
    return all(lower < upper < inf and lower > -inf for lower, upper in pairs)
