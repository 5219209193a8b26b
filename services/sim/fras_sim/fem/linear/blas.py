"""Three BLAS and LAPACK routines on blocks of a larger array, which scipy's wrappers would copy."""
# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false
# pyright: reportUnknownArgumentType=false, reportAttributeAccessIssue=false
# Reason: scipy.linalg ships no types.

import ctypes
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import cython_blas, cython_lapack

Address = int
Call = Callable[[], None]

_pointer = ctypes.pythonapi.PyCapsule_GetPointer
_pointer.restype, _pointer.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
_signature = ctypes.pythonapi.PyCapsule_GetName
_signature.restype, _signature.argtypes = ctypes.c_char_p, [ctypes.py_object]


class BlockRoutines:
    """Calls on column-major blocks with one leading dimension, prepared once and made often.

    Parameters
    ----------
    dtype : float32 or float64
    leading : int
        Distance between the columns of every block, in numbers.

    Notes
    -----
    Blocks are given by address: whoever asks for a call keeps the array alive. Preparing the
    arguments ahead leaves a microsecond for a call. ``info`` is the result of the last `cholesky`.
    """

    def __init__(self, dtype: type[np.float32] | type[np.float64], leading: int) -> None:
        letter, self._real = (
            ("s", ctypes.c_float) if dtype is np.float32 else ("d", ctypes.c_double)
        )
        self._potrf = _routine(cython_lapack, letter + "potrf", 5)
        self._trsm = _routine(cython_blas, letter + "trsm", 11)
        self._syrk = _routine(cython_blas, letter + "syrk", 10)
        self._kept: list[Any] = []
        self._leading = self._integer(leading)
        self._one, self._minus_one = self._keep(self._real(1.0)), self._keep(self._real(-1.0))
        self._left, self._right, self._transposed, self._no = (
            self._keep(ctypes.c_char(letter)) for letter in (b"L", b"R", b"T", b"N")
        )
        self.info = ctypes.c_int(0)

    def cholesky(self, n: int, a: Address) -> Call:
        """Prepare A := L with L Lᵀ = A, both in the lower triangle, n x n; see ``info``."""
        info = ctypes.addressof(self.info)
        return _prepared(self._potrf, self._left, self._integer(n), a, self._leading, info)

    def divide(self, m: int, n: int, b: Address, by: Address) -> Call:
        """Prepare B := B L⁻ᵀ, B m x n, L lower triangular."""
        shape = (self._integer(m), self._integer(n))
        how = (self._right, self._left, self._transposed, self._no)
        return _prepared(self._trsm, *how, *shape, self._one, by, self._leading, b, self._leading)

    def subtract_square(self, n: int, k: int, c: Address, a: Address) -> Call:
        """Prepare C := C - A Aᵀ in the lower triangle, C n x n, A n x k."""
        shape = (self._integer(n), self._integer(k))
        from_a = (self._minus_one, a, self._leading)
        return _prepared(
            self._syrk, self._left, self._no, *shape, *from_a, self._one, c, self._leading
        )

    def _integer(self, value: int) -> Address:
        return self._keep(ctypes.c_int(value))

    def _keep(self, value: Any) -> Address:
        self._kept.append(value)
        return ctypes.addressof(value)


def _routine(module: Any, name: str, n_arguments: int) -> Callable[..., None]:
    capsule = module.__pyx_capi__[name]
    kind = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * n_arguments)
    return kind(_pointer(capsule, _signature(capsule)))


def _prepared(routine: Callable[..., None], *arguments: Address) -> Call:
    return partial(routine, *map(ctypes.c_void_p, arguments))
