"""A symmetric matrix in band storage, factored in panels as wide as BLAS likes them."""

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.linear.band_kernels import COLUMNS, GROUP, ROWS, TRIANGLE, call_all, pack
from fras_sim.fem.linear.blas import WIDTH, BlockRoutines

# Wide enough for BLAS-3 to pay, narrow enough not to fill much of what is outside the envelope
# (24 to 48 are within 5 % of each other at every size). A multiple of `COLUMNS`.
PANEL = 48
Dtype = type[np.float32] | type[np.float64]


class Band:
    """The lower triangle inside an envelope, and the factor that takes its place.

    Parameters
    ----------
    ends : ndarray, shape (n,), int64
        Where the rows of each column end (exclusive), never decreasing; n a multiple of 48.
    dtype : float32 or float64

    Attributes
    ----------
    values : ndarray
        The storage; `place` says where an entry is.
    packed : ndarray
        The factor as `band_kernels` substitutes with it; `starts` and `ends` belong to it.

    Notes
    -----
    The entry (i, j) is at ``j * height + (i - j)`` = ``j * leading + i`` with ``leading = height -
    1``: every block below the diagonal is an ordinary column-major matrix (the trick of LAPACK's
    ``dpbtrf``). A panel of 48 columns takes one ``potrf``, one ``trsm`` and one ``syrk``. Against
    ``dpbtrf``, which works at full bandwidth throughout, each panel is as tall as its own envelope:
    less than the widest wherever nodes are fixed.
    """

    def __init__(self, ends: NDArray[np.int64], dtype: Dtype) -> None:
        starts = np.arange(0, len(ends), PANEL)
        panel_ends = ends[starts + PANEL - 1]
        self.n = len(ends)
        self.leading = int((panel_ends - starts).max(initial=PANEL))
        self.values = np.zeros(self.n * (self.leading + 1), dtype=dtype)
        self.ends = np.repeat(panel_ends, PANEL // COLUMNS)
        heights = self.ends - np.arange(COLUMNS, self.n + 1, COLUMNS)
        sizes = TRIANGLE + GROUP * -(-heights // ROWS)
        self.starts = np.concatenate([[0], np.cumsum(sizes)])
        self.packed = np.zeros(int(self.starts[-1]), dtype=dtype)
        self._routines = BlockRoutines(dtype)
        rows = [self._panel(int(k), int(end)) for k, end in zip(starts, panel_ends, strict=True)]
        self._calls = np.array([row for panel in rows for row in panel], np.int64).reshape(
            -1, WIDTH
        )
        # Of each panel, where its calls begin.
        self._begin = np.concatenate([[0], np.cumsum([len(calls) for calls in rows])])

    def place(self, columns: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return where in `values` these entries of the lower triangle are."""
        return columns * self.leading + rows

    def factorize(self, first: int, last: int) -> int | None:
        """Eliminate the columns `first` to `last` (exclusive), both multiples of 48.

        What is behind them becomes their Schur complement.

        Returns
        -------
        int or None
            The column whose pivot is not positive or not finite, if one isn't.
        """
        begin, end = self._begin[first // PANEL], self._begin[last // PANEL]
        info = self._routines.info
        failed = call_all(self._calls, begin, end, info)
        if failed >= 0:
            panel = int(np.searchsorted(self._begin, failed, side="right")) - 1
            return panel * PANEL + int(info[0]) - 1
        pivots = self.values[first * (self.leading + 1) : last * (self.leading + 1)]
        bad = np.flatnonzero(~np.isfinite(pivots[:: self.leading + 1]))
        if len(bad):
            return first + int(bad[0])
        pack(self.values, self.leading, self.ends, self.starts, first, last, self.packed)
        return None

    def _panel(self, start: int, end: int) -> list[list[int]]:
        """Return the calls that factor one panel and take its share off what follows."""
        size = self.values.itemsize
        diagonal = self.values.ctypes.data + size * start * (self.leading + 1)
        below = diagonal + size * PANEL
        following = diagonal + size * PANEL * (self.leading + 1)
        height = end - start - PANEL
        calls = [self._routines.cholesky(PANEL, diagonal, self.leading)]
        if height > 0:
            calls.append(self._routines.divide(height, PANEL, below, diagonal, self.leading))
            calls.append(self._routines.subtract_square(height, PANEL, following, self.leading, below, self.leading))
        return calls
