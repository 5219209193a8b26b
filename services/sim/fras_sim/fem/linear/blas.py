"""Three BLAS and LAPACK routines on blocks of a larger array, for compiled loops.

scipy's wrappers copy such blocks and hold the interpreter's lock, numba's linear algebra knows only
whole arrays. Here a call is prepared as a row of numbers, its routine and the addresses of its
arguments, and made from compiled code.
"""
# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false
# pyright: reportUnknownArgumentType=false, reportAttributeAccessIssue=false
# pyright: reportUntypedFunctionDecorator=false, reportUnknownParameterType=false
# pyright: reportMissingParameterType=false, reportCallIssue=false
# Reason: neither scipy.linalg nor numba and llvmlite ship types.

from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import get_cython_function_address, intrinsic
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import NDArray

Address = int
Dtype = type[np.float32] | type[np.float64]
# Kinds of calls, the first number of their row; then the routine and its arguments.
CHOLESKY, DIVIDE, SUBTRACT_SQUARE = 0, 1, 2
WIDTH = 13


class BlockRoutines:
    """Calls on column-major blocks.

    Parameters
    ----------
    dtype : float32 or float64

    Notes
    -----
    Blocks are given by address and leading dimension, the distance between their columns in
    numbers: whoever makes the calls keeps the array alive, and this object. ``info`` (1,) is the
    result of the last `cholesky` made.
    """

    def __init__(self, dtype: Dtype) -> None:
        letter = "s" if dtype is np.float32 else "d"
        self._potrf = _routine("cython_lapack", letter + "potrf")
        self._trsm = _routine("cython_blas", letter + "trsm")
        self._syrk = _routine("cython_blas", letter + "syrk")
        self._kept: list[NDArray[Any]] = []
        self._integers: dict[int, Address] = {}
        self._one, self._minus_one = (self._keep(np.array([x], dtype)) for x in (1.0, -1.0))
        self._lower, self._right, self._transposed, self._no = (
            self._keep(np.array([letter], "S1")) for letter in (b"L", b"R", b"T", b"N")
        )
        self.info = np.zeros(1, dtype=np.int32)

    def cholesky(self, n: int, a: Address, leading: int) -> list[int]:
        """Prepare A := L with L Lᵀ = A, both in the lower triangle, n x n; see ``info``."""
        shape = (self._lower, self._integer(n))
        return _row(CHOLESKY, self._potrf, *shape, a, self._integer(leading), self.info.ctypes.data)

    def divide(self, m: int, n: int, b: Address, by: Address, leading: int) -> list[int]:
        """Prepare B := B L⁻ᵀ, B m x n, L lower triangular; one leading dimension for both."""
        how = (self._right, self._lower, self._transposed, self._no)
        shape = (self._integer(m), self._integer(n))
        ld = self._integer(leading)
        return _row(DIVIDE, self._trsm, *how, *shape, self._one, by, ld, b, ld)

    def subtract_square(
        self, n: int, k: int, c: Address, leading_c: int, a: Address, leading_a: int
    ) -> list[int]:
        """Prepare C := C - A Aᵀ in the lower triangle, C n x n, A n x k."""
        shape = (self._lower, self._no, self._integer(n), self._integer(k))
        square = (self._minus_one, a, self._integer(leading_a))
        return _row(
            SUBTRACT_SQUARE, self._syrk, *shape, *square, self._one, c, self._integer(leading_c)
        )

    def _integer(self, value: int) -> Address:
        if value not in self._integers:
            self._integers[value] = self._keep(np.array([value], np.int32))
        return self._integers[value]

    def _keep(self, value: NDArray[Any]) -> Address:
        self._kept.append(value)
        return value.ctypes.data


def _routine(module: str, name: str) -> Address:
    return int(get_cython_function_address(f"scipy.linalg.{module}", name))


def _row(kind: int, routine: Address, *arguments: Address) -> list[int]:
    return [kind, routine, *arguments, *[0] * (WIDTH - 2 - len(arguments))]


@intrinsic
def _call(typing_context: Any, routine: Any, arguments: Any) -> Any:
    """Call the function at an address with pointers, given as a tuple of addresses."""

    def generate(context: Any, builder: ir.IRBuilder, signature: Any, values: Any) -> Any:
        address, tuple_of_addresses = values
        given = [builder.extract_value(tuple_of_addresses, k) for k in range(len(arguments))]
        # An address goes where a pointer goes: in an integer register or on the stack.
        kind = ir.FunctionType(ir.VoidType(), [value.type for value in given])
        builder.call(builder.inttoptr(address, kind.as_pointer()), given)
        return context.get_dummy_value()

    return types.void(routine, arguments), generate


@njit(inline="always")
def call_routine(row: NDArray[np.int64]) -> None:
    """Make one prepared call."""
    if row[0] == CHOLESKY:
        _call(row[1], to_fixed_tuple(row[2:7], 5))
    elif row[0] == DIVIDE:
        _call(row[1], to_fixed_tuple(row[2:13], 11))
    else:
        _call(row[1], to_fixed_tuple(row[2:12], 10))
