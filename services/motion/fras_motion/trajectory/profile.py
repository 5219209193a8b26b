# pyright: reportMissingTypeStubs=false, reportMissingModuleSource=false
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportAttributeAccessIssue=false
"""Time scaling from rest to rest (this file alone sees ruckig, which ships no types)."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, inf

import ruckig

from fras_common.errors import FrasError

__all__ = ["Limits", "Profile", "ProfileImpossible", "rest_to_rest"]

# To walk through a longer motion takes more seconds than anyone waits for motion's answer.
_MOST_TICKS = 100_000


class ProfileImpossible(FrasError):
    """No time scaling obeys the limits over this distance.

    Parameters
    ----------
    distance : float
        Length of the path [m or rad].
    code : int
        Ruckig's result code.
    """

    distance: float
    code: int

    def __init__(self, distance: float, code: int) -> None:
        super().__init__(
            f"no motion profile over {distance} (ruckig result {code}); the distance and the "
            f"limits must be finite and positive, and the motion of {_MOST_TICKS} ticks at most",
            distance=distance,
            code=code,
        )


@dataclass(frozen=True)
class Limits:
    """Bounds of a motion along its path.

    Parameters
    ----------
    speed, acceleration, jerk : float
        Largest magnitudes [path unit per s, s^2, s^3]; the jerk may be infinite.
    """

    speed: float
    acceleration: float
    jerk: float = inf


@dataclass(frozen=True)
class Profile:
    """A motion along a path, sampled at the ticks.

    Parameters
    ----------
    positions : tuple of float
        Distance from the start after tick 1, 2, ... ; the last is the whole path [path unit].
    velocities : tuple of float
        Its rate at the same instants; the last is 0 [path unit/s].
    """

    positions: tuple[float, ...]
    velocities: tuple[float, ...]


def rest_to_rest(distance: float, limits: Limits, dt_s: float) -> Profile:
    """Fastest motion over a distance, at rest at both ends.

    Parameters
    ----------
    distance : float
        Length of the path, positive [path unit].
    limits : Limits
        Bounds of speed, acceleration and jerk.
    dt_s : float
        Duration of a tick [s].

    Returns
    -------
    Profile
        One sample a tick; the motion ends within the last of them.

    Raises
    ------
    ProfileImpossible
        The distance or a limit is not positive or not a number, or the motion takes too long.
    """
    generator = ruckig.Ruckig(1)
    request = ruckig.InputParameter(1)
    request.current_position = [0.0]
    request.target_position = [distance]
    request.max_velocity = [limits.speed]
    request.max_acceleration = [limits.acceleration]
    request.max_jerk = [limits.jerk]
    trajectory = ruckig.Trajectory(1)
    try:
        code = generator.calculate(request, trajectory)
    except ruckig.RuckigError as fault:
        raise ProfileImpossible(distance, int(ruckig.Result.ErrorInvalidInput)) from fault
    if code != ruckig.Result.Working or not distance > 0.0:
        raise ProfileImpossible(distance, int(code))
    # A motion that ends a rounding after a tick needs no further tick for it.
    if not trajectory.duration <= _MOST_TICKS * dt_s:
        raise ProfileImpossible(distance, int(code))
    ticks = max(1, ceil(trajectory.duration / dt_s - 1e-9))
    samples = [trajectory.at_time(tick * dt_s) for tick in range(1, ticks)]
    return Profile(
        (*(float(position[0]) for position, _, _ in samples), distance),
        (*(float(velocity[0]) for _, velocity, _ in samples), 0.0),
    )
