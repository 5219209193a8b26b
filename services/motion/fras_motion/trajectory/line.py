"""A straight line in space, by its arc length."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import dist

from fras_motion.kinematics import Vector3

__all__ = ["Line"]


@dataclass(frozen=True)
class Line:
    """From `start` to `end`.

    Parameters
    ----------
    start, end : tuple of float, length 3
        Ends of the line [m].
    """

    start: Vector3
    end: Vector3

    @cached_property
    def length(self) -> float:
        """Length of the line [m]."""
        return dist(self.start, self.end)

    def point(self, s: float) -> Vector3:
        """Point at an arc length.

        Parameters
        ----------
        s : float
            Distance from the start [m], 0 .. length.

        Returns
        -------
        tuple of float, length 3
            The point [m]; exactly `end` at `length`.
        """
        if s >= self.length:
            return self.end
        share = s / self.length
        (ax, ay, az), (bx, by, bz) = self.start, self.end
        return (ax + share * (bx - ax), ay + share * (by - ay), az + share * (bz - az))
