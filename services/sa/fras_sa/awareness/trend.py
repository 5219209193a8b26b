"""The force's trend: how fast it changes, and at which tick it will cross its limit.

What is kept from tick to tick is the force and the rate that the last verdict told, so that a
verdict restores it to the last bit.
"""

import math
from dataclasses import dataclass
from typing import Self

from .views import Level

SMOOTHING_S = 0.02
"""Time constant of the rate: one default tick, half of the weight on the last difference."""

HORIZON_S = 0.5
"""Nothing is predicted beyond: up to here 19 of 20 predictions are right to 3 ticks."""

ROUSING_SHARE = 0.2
"""Below this share of the limit nothing is predicted: the growth of next to nothing is noise."""

NO_CROSSING = -1


@dataclass(frozen=True, slots=True)
class Trend:
    """Force and rate after a tick.

    Parameters
    ----------
    tick : int
        The last one judged; -1 at the start of a trial, whose first tick is 0.
    force_n : float or None [N]
        Its force; None if it was invalid, so that no difference is taken across it.
    rate_n_s : float [N/s]
        Smoothed rate of the force; an invalid tick leaves it.
    """

    tick: int = -1
    force_n: float | None = None
    rate_n_s: float = 0.0

    @classmethod
    def restored(cls, tick: int, level: Level, force_n: float, rate_n_s: float) -> Self:
        """Return the trend after a tick from what its verdict told."""
        return cls(tick, None if level == "invalid" else force_n, rate_n_s)

    def after(self, tick: int, force_n: float | None, dt_s: float) -> "Trend":
        """Return the trend one tick on.

        Parameters
        ----------
        tick : int
            The tick judged now.
        force_n : float or None [N]
            Its force; None if the tick is invalid.
        dt_s : float [s]
            Duration of a tick.

        Notes
        -----
        ``rate += dt / (dt + SMOOTHING_S) (difference / dt - rate)``, exponential smoothing.
        """
        if force_n is None or self.force_n is None:
            return Trend(tick, force_n, self.rate_n_s)
        step_n_s = (force_n - self.force_n) / dt_s
        weight = dt_s / (dt_s + SMOOTHING_S)
        rate_n_s = self.rate_n_s + weight * (step_n_s - self.rate_n_s)
        # Forces near the largest number there is would leave no number for good.
        return Trend(tick, force_n, rate_n_s if math.isfinite(rate_n_s) else 0.0)

    def crossing_tick(self, limit_n: float, dt_s: float) -> int:
        """Return the first tick expected above `limit_n`; -1 if none is within the horizon.

        Parameters
        ----------
        limit_n : float [N]
            Infinite where none binds.
        dt_s : float [s]
            Duration of a tick.

        Notes
        -----
        The force of a pull grows in proportion to itself, ``f' = g f`` (measured; `fras bench
        awareness`), so it is at the limit after ``f / f' ln(limit / f)``. A straight line
        through the last two ticks comes too late, by a quarter of the time left.
        """
        force_n = self.force_n
        if force_n is None or not ROUSING_SHARE * limit_n <= force_n <= limit_n:
            return NO_CROSSING
        needed_n = force_n * math.log(limit_n / force_n)
        if self.rate_n_s <= 0.0 or self.rate_n_s * HORIZON_S < needed_n:
            return NO_CROSSING
        return self.tick + math.floor(needed_n / self.rate_n_s / dt_s) + 1


AT_REST = Trend()
"""Before the first tick of a trial."""
