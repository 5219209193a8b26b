"""The limited-memory BFGS update on top of a factored Hessian."""

from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

# Pairs whose curvature is a rounding error would blow up the inverse.
MIN_CURVATURE = 1e-12


class LbfgsMemory:
    """The last few steps and the gradient changes they caused.

    Notes
    -----
    Two-loop recursion of Nocedal, Wright, *Numerical Optimization*, 2nd ed., algorithm 7.4, with
    the factored Hessian in the place of the scaled identity.
    """

    def __init__(self, history: int) -> None:
        self._pairs: deque[tuple[NDArray[np.float64], NDArray[np.float64], float]] = deque(
            maxlen=history
        )

    def clear(self) -> None:
        """Forget everything."""
        self._pairs.clear()

    def add(self, step: NDArray[np.float64], change: NDArray[np.float64]) -> None:
        """Remember that `step` changed the gradient by `change`."""
        curvature = float(step @ change)
        if curvature > MIN_CURVATURE * float(np.linalg.norm(step) * np.linalg.norm(change)):
            self._pairs.append((step, change, 1.0 / curvature))

    def direction(
        self,
        gradient: NDArray[np.float64],
        solve: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    ) -> NDArray[np.float64]:
        """Return ``-H gradient``, H the approximate inverse Hessian, H0 = `solve`."""
        q = -gradient
        weights: list[float] = []
        for step, change, scale in reversed(self._pairs):
            weight = scale * float(step @ q)
            q -= weight * change
            weights.append(weight)
        r = solve(q)
        for (step, change, scale), weight in zip(self._pairs, reversed(weights), strict=True):
            r += (weight - scale * float(change @ r)) * step
        return r
