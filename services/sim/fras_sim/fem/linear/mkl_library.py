"""Find and load Intel's MKL so that the same input gives the same bits."""

import ctypes
import importlib.metadata
from functools import cache

from fras_sim.fem.errors import FemError

# Where no wheel tells the path (conda, a system package) the loader may know the name.
LIBRARY_NAMES = ("libmkl_rt.so.3", "libmkl_rt.so.2", "libmkl_rt.so", "mkl_rt.3.dll", "mkl_rt.2.dll")
# Values of mkl_service.h and mkl_types.h.
THREADING_SEQUENTIAL = 1
INTERFACE_LP64 = 0
CBWR_ALL = -1
CBWR_AUTO = 2
CBWR_SUCCESS = 0


class SolverUnavailable(FemError):
    """A linear solver that this installation lacks.

    Attributes: ``solver``.
    """


@cache
def mkl_library() -> ctypes.CDLL:
    """Return MKL's runtime library: one thread, 32-bit integers, reproducible.

    Raises
    ------
    SolverUnavailable
        If it is not installed or can't be loaded.

    Notes
    -----
    Threads, integer size and conditional numerical reproducibility (CNR) belong to the process and
    must be set before the library's first call. CNR's branch ``AUTO`` fixes cache sizes and the
    order of reductions for this kind of processor; the narrower branches exist on Intel's own
    processors only, ``COMPATIBLE`` takes twice as long. Where somebody has used MKL in this process
    before, its setting stays and is refused if it is not reproducible.
    """
    library = _loaded()
    library.MKL_Set_Interface_Layer(INTERFACE_LP64)
    library.MKL_Set_Threading_Layer(THREADING_SEQUENTIAL)
    refused = library.MKL_CBWR_Set(CBWR_AUTO) != CBWR_SUCCESS
    if refused and library.MKL_CBWR_Get(CBWR_ALL) < CBWR_AUTO:
        raise SolverUnavailable(
            "MKL was used in this process before it could be made reproducible: set MKL_CBWR=AUTO "
            "in the environment, or solver = 'scipy'",
            solver="mkl",
        )
    return library


def has_mkl() -> bool:
    """Whether MKL can be loaded."""
    try:
        mkl_library()
    except SolverUnavailable:
        return False
    return True


def _loaded() -> ctypes.CDLL:
    failures: list[str] = []
    for name in (*_from_wheel(), *LIBRARY_NAMES):
        try:
            return ctypes.CDLL(name)
        except OSError as error:
            failures.append(str(error))
    raise SolverUnavailable(
        "MKL is not installed: `pip install 'fras[mkl]'` (x86-64 only), or solver = 'scipy' "
        f"({failures[0]})",
        solver="mkl",
    )


def _from_wheel() -> list[str]:
    try:
        files = importlib.metadata.files("mkl") or []
    except importlib.metadata.PackageNotFoundError:
        return []
    return [str(file.locate()) for file in files if "mkl_rt" in file.name]
