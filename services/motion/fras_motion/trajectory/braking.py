"""One tick of a stop, and one tick of a retreat, along a path."""

from __future__ import annotations

from math import copysign, sqrt

__all__ = ["brake", "retreat"]

# A stop that ends a rounding after a tick needs no further tick for it.
_ROUNDING = 1.0 + 1e-9


def brake(
    position: float, velocity: float, deceleration: float, dt_s: float
) -> tuple[float, float]:
    """Decelerate for one tick, to rest if the tick suffices.

    Parameters
    ----------
    position, velocity : float
        Where on its path the motion is [path unit], and how fast, in either direction.
    deceleration : float
        Constant magnitude of the deceleration [path unit/s^2].
    dt_s : float
        Duration of a tick [s].

    Returns
    -------
    position, velocity : float
        After the tick. The whole way to rest is v^2 / (2 a), whatever the ticks.
    """
    change = deceleration * dt_s
    if abs(velocity) <= change * _ROUNDING:
        return position + copysign(velocity * velocity / (2.0 * deceleration), velocity), 0.0
    slower = velocity - copysign(change, velocity)
    return position + 0.5 * (velocity + slower) * dt_s, slower


def retreat(
    position: float, velocity: float, floor: float, speed: float, acceleration: float, dt_s: float
) -> tuple[float, float]:
    """Move backwards for one tick, so that a stop at `floor` stays possible.

    Parameters
    ----------
    position, velocity : float
        Where on its path the motion is [path unit], and its velocity (<= 0).
    floor : float
        Position that must not be passed [path unit].
    speed, acceleration : float
        Limits of the retreat [path unit/s, path unit/s^2].
    dt_s : float
        Duration of a tick [s].

    Returns
    -------
    position, velocity : float
        After the tick; at rest exactly at `floor` when there is no way left.

    Notes
    -----
    With w = -velocity, the way d left, and w' the speed after the tick, the tick travels
    (w + w') dt / 2 and the stop after it w'^2 / (2 a); the largest admissible w' is the positive
    root of w'^2 / (2 a) + w' dt / 2 + w dt / 2 - d = 0.
    """
    backwards = -velocity
    left = position - floor
    half = 0.5 * acceleration * dt_s
    discriminant = half * half + 2.0 * acceleration * (left - 0.5 * backwards * dt_s)
    possible = sqrt(discriminant) - half if discriminant > 0.0 else 0.0
    faster = min(backwards + acceleration * dt_s, speed, possible)
    if faster > speed * 1e-9:
        return max(floor, position - 0.5 * (backwards + faster) * dt_s), -faster
    if backwards <= acceleration * dt_s * _ROUNDING:
        # Between the shortest stop and half a tick's way: a late stop within the tick ends there.
        return floor, 0.0
    return brake(position, velocity, acceleration, dt_s)
