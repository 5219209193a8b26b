"""What is done with a band and its factor, compiled by numba.

One call does all that a half needs, without the interpreter's lock.

In band storage L(i, j) is at ``j * leading + i``. Columns come in fours: `ends` (n / 4,) is where
the rows of each four end, n a multiple of four. For substitution four columns are packed one after
the other into what is read from front to back: first the 4 x 4 triangle, row by row with its
diagonal inverted, then the rows below it by sixteens, of each column in turn; zeros fill up the
last sixteen. `starts` (n / 4 + 1,) is where each four begin.
"""
# pyright: reportUntypedFunctionDecorator=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportUnknownMemberType=false
# Reason: numba ships no types.

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fras_sim.fem.linear.blas import CHOLESKY, call_routine

# One pass over x for four columns of L: what is read from memory is L itself, once, in order.
COLUMNS = 4
# Fewer, and LLVM does not vectorise.
ROWS = 16
TRIANGLE = COLUMNS * COLUMNS
GROUP = COLUMNS * ROWS
FASTMATH = {"reassoc", "contract"}
Ints = NDArray[np.int64]


def _for_both(signature: str) -> list[str]:
    return [signature.replace("real", real) for real in ("f4", "f8")]


@njit(_for_both("void(f8[::1], i8[::1], i8[::1], i8[::1], real[::1])"), cache=True, nogil=True)
def fill(values: NDArray[Any], entries: Ints, places: Ints, idle: Ints, L: NDArray[Any]) -> None:
    """Put `values[entries]` at `places` of the band, one at `idle`, zero elsewhere."""
    L[:] = 0.0
    for k in range(len(places)):
        L[places[k]] = values[entries[k]]
    for k in range(len(idle)):
        L[idle[k]] = 1.0


@njit("i8(i8[:, ::1], i8, i8, i4[::1])", cache=True, nogil=True)
def call_all(calls: Ints, begin: int, end: int, info: NDArray[np.int32]) -> int:
    """Make prepared calls of BLAS in turn; return which Cholesky one failed, or -1.

    `info` (1,) is where those leave their result.
    """
    for k in range(begin, end):
        call_routine(calls[k])
        if calls[k, 0] == CHOLESKY and info[0] != 0:
            return k
    return -1


@njit(_for_both("void(real[::1], i8, i8[::1], i8[::1], i8, i8, real[::1])"), cache=True, nogil=True)
def pack(
    L: NDArray[Any],
    leading: int,
    ends: Ints,
    starts: Ints,
    first: int,
    last: int,
    packed: NDArray[Any],
) -> None:
    """Pack the columns `first` to `last` (exclusive), multiples of four."""
    one = packed.dtype.type(1.0)
    for j in range(first, last, COLUMNS):
        at, end = starts[j // COLUMNS], ends[j // COLUMNS]
        for a in range(COLUMNS):
            for b in range(a):
                packed[at + COLUMNS * a + b] = L[(j + b) * leading + j + a]
            packed[at + (COLUMNS + 1) * a] = one / L[(j + a) * leading + j + a]
        at += TRIANGLE
        for start in range(j + COLUMNS, end, ROWS):
            height = min(ROWS, end - start)
            for a in range(COLUMNS):
                column = L[(j + a) * leading + start : (j + a) * leading + start + height]
                packed[at : at + height] = column
                packed[at + height : at + ROWS] = 0.0
                at += ROWS


@njit(
    _for_both("void(real[::1], i8[::1], i8[::1], i8, i8, real[::1])"),
    cache=True,
    nogil=True,
    fastmath=FASTMATH,
)
def forward(
    packed: NDArray[Any], starts: Ints, ends: Ints, first: int, last: int, x: NDArray[Any]
) -> None:
    """Solve ``L y = x`` for the columns `first` to `last`, and take them off the rows below.

    x (n + 16,) ends in room for what fills up the last rows.
    """
    for j in range(first, last, COLUMNS):
        at = starts[j // COLUMNS]
        x0 = x[j] * packed[at]
        x1 = (x[j + 1] - packed[at + 4] * x0) * packed[at + 5]
        x2 = (x[j + 2] - packed[at + 8] * x0 - packed[at + 9] * x1) * packed[at + 10]
        x3 = x[j + 3] - packed[at + 12] * x0 - packed[at + 13] * x1 - packed[at + 14] * x2
        x3 *= packed[at + 15]
        x[j], x[j + 1], x[j + 2], x[j + 3] = x0, x1, x2, x3
        at += TRIANGLE
        for start in range(j + COLUMNS, ends[j // COLUMNS], ROWS):
            below, group = x[start : start + ROWS], packed[at : at + GROUP]
            for k in range(ROWS):
                below[k] -= (
                    group[k] * x0
                    + group[ROWS + k] * x1
                    + group[2 * ROWS + k] * x2
                    + group[3 * ROWS + k] * x3
                )
            at += GROUP


@njit(
    _for_both("void(f8[::1], i8[::1], i8, real[::1], i8[::1], i8[::1], i8, real[::1])"),
    cache=True,
    nogil=True,
    fastmath=FASTMATH,
)
def take_forward(
    rhs: NDArray[Any],
    rows: Ints,
    place: int,
    packed: NDArray[Any],
    starts: Ints,
    ends: Ints,
    last: int,
    x: NDArray[Any],
) -> None:
    """Put ``rhs[rows]`` at x[place:], else zero; solve ``L y = x`` for the columns to `last`."""
    x[:] = 0.0
    for k in range(len(rows)):
        x[place + k] = rhs[rows[k]]
    forward(packed, starts, ends, 0, last, x)


@njit(
    _for_both("void(real[::1], i8[::1], i8[::1], i8, i8, real[::1])"),
    cache=True,
    nogil=True,
    fastmath=FASTMATH,
)
def backward(
    packed: NDArray[Any], starts: Ints, ends: Ints, first: int, last: int, x: NDArray[Any]
) -> None:
    """Solve ``Lᵀ y = x`` for the columns `first` to `last`, given the rows below."""
    sums = np.empty(GROUP, dtype=packed.dtype)
    for j in range(last - COLUMNS, first - 1, -COLUMNS):
        at = starts[j // COLUMNS]
        triangle = packed[at : at + TRIANGLE]
        sums[:] = 0.0
        # From the last rows to the first: memory is read in one direction here, too.
        for g in range((starts[j // COLUMNS + 1] - at - TRIANGLE) // GROUP - 1, -1, -1):
            start, group_at = j + COLUMNS + g * ROWS, at + TRIANGLE + g * GROUP
            below, group = x[start : start + ROWS], packed[group_at : group_at + GROUP]
            for k in range(ROWS):
                sums[k] += group[k] * below[k]
                sums[ROWS + k] += group[ROWS + k] * below[k]
                sums[2 * ROWS + k] += group[2 * ROWS + k] * below[k]
                sums[3 * ROWS + k] += group[3 * ROWS + k] * below[k]
        x0, x1, x2, x3 = x[j], x[j + 1], x[j + 2], x[j + 3]
        for k in range(ROWS):
            x0 -= sums[k]
            x1 -= sums[ROWS + k]
            x2 -= sums[2 * ROWS + k]
            x3 -= sums[3 * ROWS + k]
        x3 *= triangle[15]
        x2 = (x2 - triangle[14] * x3) * triangle[10]
        x1 = (x1 - triangle[9] * x2 - triangle[13] * x3) * triangle[5]
        x0 = (x0 - triangle[4] * x1 - triangle[8] * x2 - triangle[12] * x3) * triangle[0]
        x[j], x[j + 1], x[j + 2], x[j + 3] = x0, x1, x2, x3


@njit(
    _for_both("void(real[::1], i8[::1], i8[::1], i8, real[::1], i8[::1], i8, f8[::1])"),
    cache=True,
    nogil=True,
)
def backward_give(
    packed: NDArray[Any],
    starts: Ints,
    ends: Ints,
    last: int,
    x: NDArray[Any],
    rows: Ints,
    place: int,
    answer: NDArray[Any],
) -> None:
    """Solve ``Lᵀ y = x`` for the columns to `last`; put x[place:] at ``answer[rows]``."""
    backward(packed, starts, ends, 0, last, x)
    for k in range(len(rows)):
        answer[rows[k]] = x[place + k]
