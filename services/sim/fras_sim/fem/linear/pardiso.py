"""MKL PARDISO: a supernodal Cholesky factorisation with nested dissection."""

import ctypes
import weakref
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.errors import FactorizationFailed
from fras_sim.fem.linear.mkl_library import mkl_library
from fras_sim.fem.pattern import SparsityPattern

Dtype = type[np.float32] | type[np.float64]

POSITIVE_DEFINITE = 2
ANALYSE, FACTORIZE, SOLVE, RELEASE = 11, 22, 33, -1
NOT_POSITIVE_DEFINITE = -4
# Cache lines: CNR promises the same bits for arrays of the same alignment.
ALIGNMENT = 64
# Places in PARDISO's table of parameters, from 0 (oneMKL reference, "pardiso iparm parameter").
NOT_DEFAULTS, REORDERING, PRECISION, ZERO_BASED = 0, 1, 27, 34
PIVOT_ROW = 29
FACTOR_ENTRIES, REPORT = 17, -1
METIS = 2


class Pardiso:
    """Factors and solves with MKL PARDISO (matrix type 2) on one thread.

    Parameters
    ----------
    pattern : SparsityPattern
        Analysed here, once; entries then come again and again.
    dtype : float32 or float64
        Precision of the factor.

    Raises
    ------
    SolverUnavailable
        If MKL can't be loaded.

    Notes
    -----
    MKL is called through ctypes: `pypardiso` compares and copies the whole matrix for each call,
    keeps no analysis apart from a factor, knows no single precision, sets neither threads nor
    reproducibility, and is a dependency for what is one function.
    """

    def __init__(self, pattern: SparsityPattern, dtype: Dtype = np.float64) -> None:
        self.name = "mkl" if dtype is np.float64 else "mkl-single"
        self._indptr = pattern.indptr.astype(np.int32)
        self._indices = pattern.indices.astype(np.int32)
        self._values = _aligned(pattern.n_entries, dtype)
        self._rhs = _aligned(pattern.n, dtype)
        self._solution = _aligned(pattern.n, dtype)
        self._options = np.zeros(64, dtype=np.int32)
        self._options[NOT_DEFAULTS] = 1
        self._options[REORDERING] = METIS
        self._options[PRECISION] = dtype is np.float32
        self._options[ZERO_BASED] = 1
        self._options[FACTOR_ENTRIES] = REPORT
        self._call = _pardiso(
            pattern.n,
            (self._values, self._indptr, self._indices),
            self._options,
            (self._rhs, self._solution),
        )
        weakref.finalize(self, self._call, RELEASE)
        self._checked(ANALYSE)

    @property
    def factor_bytes(self) -> int:
        """Size of the factor, by what the analysis says."""
        return int(self._options[FACTOR_ENTRIES]) * self._values.itemsize

    def factorize(self, values: NDArray[np.float64]) -> None:
        """Take new entries and factor."""
        # PARDISO doesn't look for NaN and answers it with NaN.
        if not np.isfinite(values.sum()):
            raise FactorizationFailed("the matrix has entries that are not finite", row=0)
        self._values[:] = values
        self._checked(FACTORIZE)

    def solve(self, rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return x with A x = rhs."""
        self._rhs[:] = rhs
        self._checked(SOLVE)
        return self._solution.astype(np.float64)

    def _checked(self, phase: int) -> None:
        error = self._call(phase)
        if error == NOT_POSITIVE_DEFINITE:
            row = int(self._options[PIVOT_ROW]) - 1
            raise FactorizationFailed(
                f"the matrix is not positive definite at row {row} of {len(self._rhs)}: "
                "check mass, stiffness and that no coordinate is infinite",
                row=row,
            )
        if error != 0:
            raise FactorizationFailed(
                f"MKL PARDISO gave up in phase {phase} with error {error} (oneMKL reference, "
                "pardiso): try solver = 'scipy'",
                error=error,
            )


def _pardiso(
    n: int,
    matrix: tuple[NDArray[np.floating], NDArray[np.int32], NDArray[np.int32]],
    options: NDArray[np.int32],
    vectors: tuple[NDArray[np.floating], NDArray[np.floating]],
) -> Callable[[int], int]:
    """Return the call of PARDISO for a phase; what it returns is the error. It owns the arrays."""
    routine = mkl_library().pardiso
    routine.restype = None
    handle = np.zeros(64, dtype=np.int64)
    # Of every row whether it is part of a Schur complement: none.
    permutation = np.zeros(n, dtype=np.int32)
    phase, error = ctypes.c_int(0), ctypes.c_int(0)
    one, size, kind, silent = map(ctypes.c_int, (1, n, POSITIVE_DEFINITE, 0))
    arrays = (handle, *matrix, permutation, options, *vectors)
    at = [ctypes.c_void_p(array.ctypes.data) for array in arrays]
    numbers = [ctypes.byref(number) for number in (one, one, kind, phase, size, one, silent, error)]
    arguments = [
        at[0],  # pt
        *numbers[:5],  # maxfct, mnum, mtype, phase, n
        *at[1:5],  # a, ia, ja, perm
        numbers[5],  # nrhs
        at[5],  # iparm
        numbers[6],  # msglvl
        *at[6:],  # b, x
        numbers[7],  # error
    ]

    def call(which: int) -> int:
        phase.value = which
        routine(*arguments)
        # The addresses above are good as long as their arrays are.
        return error.value if arrays else 0

    return call


def _aligned(size: int, dtype: Dtype) -> NDArray[np.floating]:
    item = np.dtype(dtype).itemsize
    buffer = np.zeros(size * item + ALIGNMENT, dtype=np.uint8)
    start = -buffer.ctypes.data % ALIGNMENT
    return buffer[start : start + size * item].view(dtype)
