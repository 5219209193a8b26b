"""Cholesky inside an envelope, in panels as wide as BLAS likes them: numpy and scipy alone."""

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.assembly import SparsityPattern
from fras_sim.fem.errors import FactorizationFailed
from fras_sim.fem.linear.blas import BlockRoutines, Call
from fras_sim.fem.linear.ordering import envelope, inverse, narrow_order
from fras_sim.fem.linear.triangular import COLUMNS, substitute

# Wide enough for BLAS-3 to pay, narrow enough not to fill much of what is outside the envelope
# (24 to 48 are within 5 % of each other at every size). A multiple of `COLUMNS`.
PANEL = 32


class BandedCholesky:
    """Blocked Cholesky factorisation in band storage.

    Parameters
    ----------
    pattern : SparsityPattern
    dtype : float32 or float64
        Precision of the factor.

    Notes
    -----
    Band storage has the entry (i, j) at ``j * height + (i - j)`` = ``j * (height - 1) + i``: every
    block below the diagonal is an ordinary column-major matrix whose leading dimension is
    ``height - 1`` (the trick of LAPACK's ``dpbtrf``). A panel of 32 columns takes one ``potrf``,
    one ``trsm`` and one ``syrk``. Against ``dpbtrf``, which works at full bandwidth throughout,
    each panel is as tall as its own envelope: less than the widest wherever nodes are fixed.
    """

    def __init__(
        self, pattern: SparsityPattern, dtype: type[np.float32] | type[np.float64] = np.float64
    ) -> None:
        n = pattern.n
        padded = -(-n // COLUMNS) * COLUMNS
        self.name = "scipy" if dtype is np.float64 else "scipy-single"
        self._order = narrow_order(pattern)
        place = inverse(self._order)
        self._starts = np.arange(0, padded, PANEL)
        ends_of_columns = np.concatenate([envelope(pattern, place), np.arange(n, padded) + 1])
        ends = ends_of_columns[np.minimum(self._starts + PANEL, padded) - 1]
        ends = np.maximum(ends, np.minimum(self._starts + PANEL, padded))
        self._leading = int((ends - self._starts).max())
        self._ends = np.repeat(ends, PANEL // COLUMNS)
        first, second = place[pattern.rows], place[pattern.indices]
        self._place = np.minimum(first, second) * self._leading + np.maximum(first, second)
        self._padding = np.arange(n, padded) * (self._leading + 1)
        self._band = np.zeros(padded * (self._leading + 1), dtype=dtype)
        self._right_side = np.zeros(padded, dtype=dtype)
        self._routines = BlockRoutines(dtype, self._leading)
        self._panels = [
            self._panel(int(start), min(PANEL, padded - int(start)), int(end))
            for start, end in zip(self._starts, ends, strict=True)
        ]

    def factorize(self, values: NDArray[np.float64]) -> None:
        """Take new entries and factor."""
        self._band[:] = 0.0
        self._band[self._place] = values
        self._band[self._padding] = 1.0
        for start, calls in zip(self._starts, self._panels, strict=True):
            for call in calls:
                call()
            if self._routines.info.value != 0:
                raise _not_positive(self._order, int(start) + self._routines.info.value - 1)
        if not np.isfinite(self._band[:: self._leading + 1]).all():
            raise _not_positive(self._order, 0)

    def solve(self, rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return x with A x = rhs."""
        n = len(self._order)
        self._right_side[:n] = rhs[self._order]
        self._right_side[n:] = 0.0
        substitute(self._band, self._leading, self._ends, self._right_side)
        x = np.empty(n)
        x[self._order] = self._right_side[:n]
        return x

    def _panel(self, start: int, width: int, end: int) -> list[Call]:
        """Return what factors one panel and takes its share off what follows."""
        size = self._band.itemsize
        base = self._band.ctypes.data
        diagonal = base + size * start * (self._leading + 1)
        below = diagonal + size * width
        following = base + size * (start + width) * (self._leading + 1)
        height = end - start - width
        calls = [self._routines.cholesky(width, diagonal)]
        if height > 0:
            calls.append(self._routines.divide(height, width, below, diagonal))
            calls.append(self._routines.subtract_square(height, width, following, below))
        return calls


def _not_positive(order: NDArray[np.int64], at: int) -> FactorizationFailed:
    row = int(order[at])
    return FactorizationFailed(
        f"the matrix is not positive definite at row {row} of {len(order)}: "
        "check mass, stiffness and that no coordinate is infinite",
        row=row,
    )
