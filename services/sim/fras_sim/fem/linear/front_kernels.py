"""What is done with the fronts of a part and their factor, compiled by numba.

One call does all that a part needs, without the interpreter's lock.

A front of s own and b border rows is a column-major matrix of f = s + b rows and s columns, in
`work`, s a multiple of four, and a b x b one for what its elimination takes off the border, in
`stack`, where its parent finds it. Only lower triangles mean anything.

For substitution four columns of L are packed one after the other into what is read from front to
back: first the 4 x 4 triangle, row by row with its diagonal inverted, then the rows below it, of
each column in turn, filled up with zeros to a multiple of sixteen.
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
# The compiler's vectors take so many rows at once: nothing is left over for a slower loop.
ROWS = 16
TRIANGLE = COLUMNS * COLUMNS
GROUP = COLUMNS * ROWS
FASTMATH = {"reassoc", "contract"}
Ints = NDArray[np.int64]

# The columns of the table of fronts: its first own row in x, s, f, where its own part of `stack`
# and of `packed` begins; where its entries, its idle rows, its children, its calls of BLAS and its
# border begin: they end where those of the next front begin, so the table ends with a row of ends.
FIRST, OWN, ALL, UPDATE, PACKED, ENTRIES, IDLE, CHILDREN, CALLS, BORDER = range(10)
# Of the table of children: where its update is in `stack`, its size, where its runs begin.
CHILD_UPDATE, CHILD_SIZE, CHILD_RUNS = range(3)
# Of the table of runs, rows that are neighbours in the parent, too: first row there, in the child,
# and the one after the last in the child.
RUN_TO, RUN_FROM, RUN_END = range(3)


def packed_size(own: int, height: int) -> int:
    """Return the numbers of a packed front of `own` columns and `height` rows."""
    below = height - np.arange(COLUMNS, own + 1, COLUMNS)
    return int((TRIANGLE + GROUP * -(-below // ROWS)).sum())


def _for_both(signature: str) -> list[str]:
    return [signature.replace("real", real) for real in ("f4", "f8")]


@njit(
    _for_both("void(real[::1], i8, i8, i8, i8, i8[:, ::1], real[::1], real[::1])"),
    cache=True,
    nogil=True,
)
def add_update(
    child: NDArray[Any],
    size: int,
    own: int,
    height: int,
    border: int,
    runs: Ints,
    work: NDArray[Any],
    update: NDArray[Any],
) -> None:
    """Add a child's lower triangle (size x size) to its parent's front."""
    for r in range(len(runs)):
        for j in range(runs[r, RUN_FROM], runs[r, RUN_END]):
            column = runs[r, RUN_TO] + j - runs[r, RUN_FROM]
            for q in range(r, len(runs)):
                begin = j if q == r else runs[q, RUN_FROM]
                n = runs[q, RUN_END] - begin
                row = runs[q, RUN_TO] + begin - runs[q, RUN_FROM]
                taken = child[j * size + begin : j * size + begin + n]
                if column < own:
                    at = column * height + row
                    into = work[at : at + n]
                else:
                    at = (column - own) * border + row - own
                    into = update[at : at + n]
                for k in range(n):
                    into[k] += taken[k]


@njit(
    _for_both("b1(real[::1], i8, i8, real[::1])"),
    cache=True,
    nogil=True,
)
def pack(work: NDArray[Any], own: int, height: int, packed: NDArray[Any]) -> bool:
    """Pack a front's columns of L; return whether all pivots are finite."""
    one = packed.dtype.type(1.0)
    at = 0
    finite = True
    for j in range(0, own, COLUMNS):
        for a in range(COLUMNS):
            for b in range(a):
                packed[at + COLUMNS * a + b] = work[(j + b) * height + j + a]
            pivot = work[(j + a) * height + j + a]
            finite = finite and np.isfinite(pivot)
            packed[at + (COLUMNS + 1) * a] = one / pivot
        at += TRIANGLE
        n = height - j - COLUMNS
        filled = (n + ROWS - 1) // ROWS * ROWS
        for a in range(COLUMNS):
            begin = (j + a) * height + j + COLUMNS
            packed[at : at + n] = work[begin : begin + n]
            packed[at + n : at + filled] = 0.0
            at += filled
    return finite


@njit(
    _for_both(
        "i8(f8[::1], i8[:, ::1], i8[:, ::1], i8[:, ::1], i8[::1], i8[::1], i8[::1], i8[:, ::1],"
        " i4[::1], real[:, ::1], real[::1], real[::1], real[::1])"
    ),
    cache=True,
    nogil=True,
)
def eliminate(
    values: NDArray[Any],
    fronts: Ints,
    children: Ints,
    runs: Ints,
    entries: Ints,
    places: Ints,
    idle: Ints,
    calls: Ints,
    info: NDArray[np.int32],
    given: NDArray[Any],
    work: NDArray[Any],
    stack: NDArray[Any],
    packed: NDArray[Any],
) -> int:
    """Eliminate front after front; return which one failed, or -1.

    `given` (m, m), [j, i] its row i in column j, is added to the first front's own columns.
    `info` (1,) says which own column of the front that failed has no positive pivot, from one; 0
    if one is not finite.
    """
    for k in range(len(fronts) - 1):
        own, height = fronts[k, OWN], fronts[k, ALL]
        border = height - own
        update = stack[fronts[k, UPDATE] : fronts[k, UPDATE] + border * border]
        work[: own * height] = 0.0
        update[:] = 0.0
        for e in range(fronts[k, ENTRIES], fronts[k + 1, ENTRIES]):
            work[places[e]] = values[entries[e]]
        for e in range(fronts[k, IDLE], fronts[k + 1, IDLE]):
            work[idle[e]] = 1.0
        for c in range(fronts[k, CHILDREN], fronts[k + 1, CHILDREN]):
            begin, size = children[c, CHILD_UPDATE], children[c, CHILD_SIZE]
            those = runs[children[c, CHILD_RUNS] : children[c + 1, CHILD_RUNS]]
            child = stack[begin : begin + size * size]
            add_update(child, size, own, height, border, those, work, update)
        if k == 0:
            for j in range(len(given)):
                for i in range(j, len(given)):
                    work[j * height + i] += given[j, i]
        for c in range(fronts[k, CALLS], fronts[k + 1, CALLS]):
            call_routine(calls[c])
            if calls[c, 0] == CHOLESKY and info[0] != 0:
                return k
        if not pack(work, own, height, packed[fronts[k, PACKED] : fronts[k + 1, PACKED]]):
            return k
    return -1


@njit(
    _for_both("void(real[::1], i8, i8, real[::1])"),
    cache=True,
    nogil=True,
    fastmath=FASTMATH,
)
def forward(packed: NDArray[Any], own: int, height: int, x: NDArray[Any]) -> None:
    """Solve ``L y = x`` for a front's own rows, and take them off its border.

    x (height + 16,) ends in room for what fills up the last rows.
    """
    at = 0
    for j in range(0, own, COLUMNS):
        x0 = x[j] * packed[at]
        x1 = (x[j + 1] - packed[at + 4] * x0) * packed[at + 5]
        x2 = (x[j + 2] - packed[at + 8] * x0 - packed[at + 9] * x1) * packed[at + 10]
        x3 = x[j + 3] - packed[at + 12] * x0 - packed[at + 13] * x1 - packed[at + 14] * x2
        x3 *= packed[at + 15]
        x[j], x[j + 1], x[j + 2], x[j + 3] = x0, x1, x2, x3
        at += TRIANGLE
        n = (height - j - COLUMNS + ROWS - 1) // ROWS * ROWS
        below = x[j + COLUMNS : j + COLUMNS + n]
        column0, column1 = packed[at : at + n], packed[at + n : at + 2 * n]
        column2, column3 = packed[at + 2 * n : at + 3 * n], packed[at + 3 * n : at + 4 * n]
        for k in range(n):
            below[k] -= column0[k] * x0 + column1[k] * x1 + column2[k] * x2 + column3[k] * x3
        at += COLUMNS * n


@njit(
    _for_both("void(real[::1], i8, i8, real[::1])"),
    cache=True,
    nogil=True,
    fastmath=FASTMATH,
)
def backward(packed: NDArray[Any], own: int, height: int, x: NDArray[Any]) -> None:
    """Solve ``Lᵀ y = x`` for a front's own rows, given its border."""
    at = len(packed)
    for j in range(own - COLUMNS, -1, -COLUMNS):
        n = (height - j - COLUMNS + ROWS - 1) // ROWS * ROWS
        at -= TRIANGLE + COLUMNS * n
        triangle = packed[at : at + TRIANGLE]
        below = x[j + COLUMNS : j + COLUMNS + n]
        begin = at + TRIANGLE
        column0, column1 = packed[begin : begin + n], packed[begin + n : begin + 2 * n]
        begin += 2 * n
        column2, column3 = packed[begin : begin + n], packed[begin + n : begin + 2 * n]
        x0, x1, x2, x3 = x[j], x[j + 1], x[j + 2], x[j + 3]
        for k in range(n):
            x0 -= column0[k] * below[k]
            x1 -= column1[k] * below[k]
            x2 -= column2[k] * below[k]
            x3 -= column3[k] * below[k]
        x3 *= triangle[15]
        x2 = (x2 - triangle[14] * x3) * triangle[10]
        x1 = (x1 - triangle[9] * x2 - triangle[13] * x3) * triangle[5]
        x0 = (x0 - triangle[4] * x1 - triangle[8] * x2 - triangle[12] * x3) * triangle[0]
        x[j], x[j + 1], x[j + 2], x[j + 3] = x0, x1, x2, x3


@njit(inline="always")
def _take(
    x: NDArray[Any], first: int, own: int, height: int, border: Ints, local: NDArray[Any]
) -> None:
    """Put what of `x` belongs to a front into `local`, zeros behind it."""
    local[:own] = x[first : first + own]
    for i in range(len(border)):
        local[own + i] = x[border[i]]
    local[height : height + ROWS] = 0.0


@njit(
    _for_both(
        "void(f8[::1], i8[::1], i8[::1], i8[:, ::1], i8[::1], real[::1], real[::1], real[::1])"
    ),
    cache=True,
    nogil=True,
)
def all_forward(
    rhs: NDArray[Any],
    rows: Ints,
    rows_at: Ints,
    fronts: Ints,
    borders: Ints,
    packed: NDArray[Any],
    x: NDArray[Any],
    local: NDArray[Any],
) -> None:
    """Put ``rhs[rows]`` at ``x[rows_at]`` and substitute forwards, front after front."""
    for k in range(len(rows)):
        x[rows_at[k]] += rhs[rows[k]]
    for k in range(len(fronts) - 1):
        first, own, height = fronts[k, FIRST], fronts[k, OWN], fronts[k, ALL]
        border = borders[fronts[k, BORDER] : fronts[k + 1, BORDER]]
        _take(x, first, own, height, border, local)
        forward(packed[fronts[k, PACKED] : fronts[k + 1, PACKED]], own, height, local)
        x[first : first + own] = local[:own]
        for i in range(len(border)):
            x[border[i]] = local[own + i]


@njit(
    _for_both(
        "void(i8[::1], i8[::1], i8[:, ::1], i8[::1], real[::1], real[::1], real[::1], f8[::1])"
    ),
    cache=True,
    nogil=True,
)
def all_backward(
    rows: Ints,
    rows_at: Ints,
    fronts: Ints,
    borders: Ints,
    packed: NDArray[Any],
    x: NDArray[Any],
    local: NDArray[Any],
    answer: NDArray[Any],
) -> None:
    """Substitute backwards, front after front, and put ``x[rows_at]`` at ``answer[rows]``."""
    for k in range(len(fronts) - 2, -1, -1):
        first, own, height = fronts[k, FIRST], fronts[k, OWN], fronts[k, ALL]
        border = borders[fronts[k, BORDER] : fronts[k + 1, BORDER]]
        _take(x, first, own, height, border, local)
        backward(packed[fronts[k, PACKED] : fronts[k + 1, PACKED]], own, height, local)
        x[first : first + own] = local[:own]
    for k in range(len(rows)):
        answer[rows[k]] = x[rows_at[k]]
