"""Cholesky inside an envelope, from both ends at once: numpy and scipy alone."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.assembly import SparsityPattern
from fras_sim.fem.errors import FactorizationFailed
from fras_sim.fem.linear.band import PANEL, Dtype
from fras_sim.fem.linear.blas_threads import one_blas_thread
from fras_sim.fem.linear.half import Half
from fras_sim.fem.linear.ordering import envelope, inverse, narrow_order
from fras_sim.fem.second_core import second_core

# With fewer operations than these one core is done before the second has been woken ...
WORTH_SPLITTING = 10_000_000
# ... likewise with a factor of fewer numbers, when it is substituted with.
WORTH_SHARING = 3_000_000


class BandedCholesky:
    """Blocked Cholesky factorisation in band storage.

    Parameters
    ----------
    pattern : SparsityPattern
    dtype : float32 or float64
        Precision of the factor.

    Notes
    -----
    A costly band is eliminated from its first row down and from its last row up at once, until the
    two meet in a separator: twice the parallelism of a band and none of a dissection's fill (the
    twisted or burn-at-both-ends factorisation; Duff, Erisman, Reid, *Direct Methods for Sparse
    Matrices*, 2nd ed., 2017). BLAS is held to one thread meanwhile: threads of its own, on cores
    that others use, can cost a hundredfold.
    """

    def __init__(self, pattern: SparsityPattern, dtype: Dtype = np.float64) -> None:
        self.name = "scipy" if dtype is np.float64 else "scipy-single"
        self._n = pattern.n
        order = narrow_order(pattern)
        place = inverse(order)
        one, other = place[pattern.rows], place[pattern.indices]
        ends = envelope(pattern.n, np.minimum(one, other), np.maximum(one, other))
        split = _split(ends)
        # Rows from here on are out of reach from above the split.
        meet = int(ends[split - 1]) if split < pattern.n else split
        above, between, below = order[:split], order[split:meet], order[meet:]
        self._above = Half(pattern, above, between, keeps_separator=True, dtype=dtype)
        self._below = Half(pattern, below[::-1], between[::-1], keeps_separator=False, dtype=dtype)
        self._shares_solving = self._above.size + self._below.size > WORTH_SHARING

    @property
    def factor_bytes(self) -> int:
        """Size of the factor."""
        return self._above.factor_bytes + self._below.factor_bytes

    def factorize(self, values: NDArray[np.float64]) -> None:
        """Take new entries and factor."""
        above, below = self._above, self._below
        with one_blas_thread():
            failed = self._of_both(lambda half: half.eliminate(values), at_once=True)
            # [j, i] of one block is [i, j] of the other, which is upside down.
            above.schur[:] += np.triu(below.schur[::-1, ::-1].T)
            failed.append(above.eliminate_separator())
        for row in failed:
            if row is not None:
                raise FactorizationFailed(
                    f"the matrix is not positive definite at row {row} of {self._n}: "
                    "check mass, stiffness and that no coordinate is infinite",
                    row=row,
                )

    def solve(self, rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return x with A x = rhs."""
        above, below = self._above, self._below
        self._of_both(lambda half: half.forward(rhs), at_once=self._shares_solving)
        above.separator[:] += below.separator[::-1]
        above.solve_separator()
        below.separator[:] = above.separator[::-1]
        answer = np.empty(self._n)
        self._of_both(lambda half: half.backward(answer), at_once=self._shares_solving)
        return answer

    def _of_both(self, work: Callable[[Half], int | None], *, at_once: bool) -> list[int | None]:
        """Return what the work gives for either half, done at once if that is worth it."""
        halves = (self._above, self._below)
        if not (at_once and self._below.alone):
            return [work(half) for half in halves]
        results: list[int | None] = [None, None]

        def do(which: int) -> None:
            results[which] = work(halves[which])

        second_core.run(lambda: do(0), lambda: do(1))
        return results


def _split(ends: NDArray[np.int64]) -> int:
    """Return how many rows to eliminate from above: a multiple of 48, or all.

    So many that either side costs the same, the separator counting as above.
    """
    n = len(ends)
    cost = np.cumsum((ends - np.arange(n)).astype(np.float64) ** 2)
    candidates = np.arange(PANEL, n, PANEL)
    if cost[-1] < WORTH_SPLITTING or len(candidates) == 0:
        return n
    beyond = cost[-1] - cost[ends[candidates - 1] - 1]
    best = int(candidates[np.argmin(np.abs(cost[candidates - 1] - beyond))])
    return best if ends[best - 1] < n else n
