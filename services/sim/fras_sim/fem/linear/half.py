"""One of the two bands in which a matrix is factored from both its ends."""

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.assembly import SparsityPattern
from fras_sim.fem.linear import band_kernels
from fras_sim.fem.linear.band import PANEL, Band, Dtype
from fras_sim.fem.linear.ordering import envelope

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class Half:
    """Some rows of a matrix, in the order of their elimination, and behind them a separator.

    Parameters
    ----------
    pattern : SparsityPattern
    rows : ndarray of int64
        The rows that are this half's alone.
    separator : ndarray of int64
        The rows that both halves reach.
    keeps_separator : bool
        Whether the separator's own entries and right side are here; else it starts from zero.
    dtype : float32 or float64

    Attributes
    ----------
    alone : int
        Columns that are eliminated without the other half, a multiple of 48: idle rows, those of
        the identity, fill the first panel, others the last of the band.
    """

    def __init__(
        self,
        pattern: SparsityPattern,
        rows: Ints,
        separator: Ints,
        *,
        keeps_separator: bool,
        dtype: Dtype,
    ) -> None:
        self.alone = _rounded_up(len(rows))
        self._first = self.alone - len(rows)
        self._end = self.alone + len(separator)
        self._kept = np.concatenate([rows, separator if keeps_separator else separator[:0]])
        place = np.full(pattern.n, -1)
        place[rows] = np.arange(self._first, self.alone)
        place[separator] = np.arange(self.alone, self._end)
        one, other = place[pattern.rows], place[pattern.indices]
        first, second = np.minimum(one, other), np.maximum(one, other)
        is_here = (first >= 0) & (first < (self._end if keeps_separator else self.alone))
        ends = envelope(_rounded_up(self._end), first[is_here], second[is_here])
        # What the halves take off the separator fills it.
        ends[self.alone : self._end] = self._end
        self._band = Band(ends, dtype)
        self._entries = np.flatnonzero(is_here)
        self._places = self._band.place(first[is_here], second[is_here])
        idle = np.setdiff1d(np.arange(len(ends)), np.arange(self._first, self._end))
        self._idle = self._band.place(idle, idle)
        self._x = np.zeros(len(ends) + band_kernels.ROWS, dtype=dtype)

    @property
    def size(self) -> int:
        """Numbers stored."""
        return self._band.values.size

    @property
    def factor_bytes(self) -> int:
        """Size of the factor as it is substituted with."""
        return self._band.packed.nbytes

    @property
    def schur(self) -> NDArray[np.floating]:
        """The separator's block (m, m), a view: [j, i], i >= j, is its row i in column j."""
        m = self._end - self.alone
        at = self._band.values[self.alone * (self._band.leading + 1) :]
        return np.lib.stride_tricks.as_strided(
            at, (m, m), (at.itemsize * self._band.leading, at.itemsize)
        )

    @property
    def separator(self) -> NDArray[np.floating]:
        """The separator's part of the right side or solution (m,), a view."""
        return self._x[self.alone : self._end]

    def eliminate(self, values: Array) -> int | None:
        """Take new entries and eliminate what is this half's alone; see `Band.factorize`.

        Returns
        -------
        int or None
            The row of the matrix whose pivot is not positive, if one isn't.
        """
        band_kernels.fill(values, self._entries, self._places, self._idle, self._band.values)
        return self._row(self._band.factorize(0, self.alone))

    def eliminate_separator(self) -> int | None:
        """Eliminate the separator, once both halves' share is in it."""
        return self._row(self._band.factorize(self.alone, self._band.n))

    def forward(self, rhs: Array) -> None:
        """Take the right side and substitute forwards with what was eliminated alone."""
        given = (rhs, self._kept, self._first)
        band_kernels.take_forward(*given, *self._factor, self.alone, self._x)

    def solve_separator(self) -> None:
        """Substitute forwards and backwards with the separator."""
        columns = (self.alone, self._band.n, self._x)
        band_kernels.forward(*self._factor, *columns)
        band_kernels.backward(*self._factor, *columns)

    def backward(self, answer: Array) -> None:
        """Substitute backwards and put the solution where it belongs."""
        place = (self._kept, self._first, answer)
        band_kernels.backward_give(*self._factor, self.alone, self._x, *place)

    @property
    def _factor(self) -> tuple[NDArray[np.floating], Ints, Ints]:
        return self._band.packed, self._band.starts, self._band.ends

    def _row(self, column: int | None) -> int | None:
        return None if column is None else int(self._kept[column - self._first])


def _rounded_up(n: int) -> int:
    return -(-n // PANEL) * PANEL
