"""The limited-memory BFGS update on top of a factored Hessian."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem import kernels

# Pairs whose curvature is a rounding error would blow up the inverse.
MIN_CURVATURE = 1e-12

Array = NDArray[np.float64]


class LbfgsMemory:
    """The last few steps and the gradient changes they caused.

    Parameters
    ----------
    history : int
        How many pairs are remembered.
    n : int
        Degrees of freedom.

    Notes
    -----
    Two-loop recursion of Nocedal, Wright, *Numerical Optimization*, 2nd ed., algorithm 7.4, with
    the factored Hessian in the place of the scaled identity. The pairs lie in a ring, in single
    precision: all are read for every direction, and the factor is no more exact.
    """

    def __init__(self, history: int, n: int) -> None:
        self._steps = np.zeros((history, n), dtype=np.float32)
        self._changes = np.zeros((history, n), dtype=np.float32)
        self._scales = np.zeros(history)
        self._weights = np.zeros(history)
        self._added = 0

    def clear(self) -> None:
        """Forget everything."""
        self._added = 0

    def add(self, step: Array, change: Array) -> None:
        """Remember that `step` changed the gradient by `change`."""
        curvature = float(step @ change)
        if curvature > MIN_CURVATURE * math.sqrt(float(step @ step) * float(change @ change)):
            at = self._added % len(self._scales)
            self._steps[at], self._changes[at], self._scales[at] = step, change, 1.0 / curvature
            self._added += 1

    def direction(self, gradient: Array, solve: Callable[[Array], Array]) -> Array:
        """Return ``-H gradient``, H the approximate inverse Hessian, H0 = `solve`."""
        pairs = (self._added, self._steps, self._changes, self._scales, self._weights)
        q = -gradient
        kernels.lbfgs_before(*pairs, q)
        r = solve(q)
        kernels.lbfgs_after(*pairs, r)
        return r
