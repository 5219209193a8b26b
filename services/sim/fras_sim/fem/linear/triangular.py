"""Forward and backward substitution inside an envelope, compiled by numba."""
# pyright: reportUntypedFunctionDecorator=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportUnknownMemberType=false
# Reason: numba ships no types.

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

# One pass over x for four columns of L: what is read from memory is L itself, once.
COLUMNS = 4
SIGNATURES = ["void(f4[::1], i8, i8[::1], f4[::1])", "void(f8[::1], i8, i8[::1], f8[::1])"]


@njit(SIGNATURES, cache=True, fastmath={"reassoc", "contract"})
def substitute(L: NDArray[Any], leading: int, ends: NDArray[np.int64], x: NDArray[Any]) -> None:
    """Replace x (n,) by the solution y of ``L Lᵀ y = x``.

    L(i, j) is at ``j * leading + i``; `ends` (ceil(n / 4),) is where the rows of each four columns
    end. n is a multiple of four.
    """
    n = len(x)
    for j in range(0, n, COLUMNS):
        end = ends[j // COLUMNS]
        c0, c1, c2, c3 = j * leading, (j + 1) * leading, (j + 2) * leading, (j + 3) * leading
        x0 = x[j] / L[c0 + j]
        x1 = (x[j + 1] - L[c0 + j + 1] * x0) / L[c1 + j + 1]
        x2 = (x[j + 2] - L[c0 + j + 2] * x0 - L[c1 + j + 2] * x1) / L[c2 + j + 2]
        x3 = x[j + 3] - L[c0 + j + 3] * x0 - L[c1 + j + 3] * x1 - L[c2 + j + 3] * x2
        x3 /= L[c3 + j + 3]
        x[j], x[j + 1], x[j + 2], x[j + 3] = x0, x1, x2, x3
        start = j + COLUMNS
        l0, l1 = L[c0 + start : c0 + end], L[c1 + start : c1 + end]
        l2, l3 = L[c2 + start : c2 + end], L[c3 + start : c3 + end]
        below = x[start:end]
        for i in range(len(below)):
            below[i] -= l0[i] * x0 + l1[i] * x1 + l2[i] * x2 + l3[i] * x3
    zero = L[0] - L[0]
    for j in range(n - COLUMNS, -1, -COLUMNS):
        end = ends[j // COLUMNS]
        c0, c1, c2, c3 = j * leading, (j + 1) * leading, (j + 2) * leading, (j + 3) * leading
        start = j + COLUMNS
        l0, l1 = L[c0 + start : c0 + end], L[c1 + start : c1 + end]
        l2, l3 = L[c2 + start : c2 + end], L[c3 + start : c3 + end]
        below = x[start:end]
        s0 = s1 = s2 = s3 = zero
        for i in range(len(below)):
            value = below[i]
            s0 += l0[i] * value
            s1 += l1[i] * value
            s2 += l2[i] * value
            s3 += l3[i] * value
        x3 = (x[j + 3] - s3) / L[c3 + j + 3]
        x2 = (x[j + 2] - s2 - L[c2 + j + 3] * x3) / L[c2 + j + 2]
        x1 = (x[j + 1] - s1 - L[c1 + j + 2] * x2 - L[c1 + j + 3] * x3) / L[c1 + j + 1]
        x0 = x[j] - s0 - L[c0 + j + 1] * x1 - L[c0 + j + 2] * x2 - L[c0 + j + 3] * x3
        x0 /= L[c0 + j]
        x[j], x[j + 1], x[j + 2], x[j + 3] = x0, x1, x2, x3
