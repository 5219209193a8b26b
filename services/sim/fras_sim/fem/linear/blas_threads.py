"""Keep BLAS to one thread while we compute."""
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportAttributeAccessIssue=false
# Reason: neither scipy.linalg nor threadpoolctl ship types.

from collections.abc import Generator
from contextlib import contextmanager
from functools import cache

from scipy.linalg import cython_blas
from threadpoolctl import ThreadpoolController

# The controller finds what is loaded by then.
LOADED = (cython_blas,)


@contextmanager
def one_blas_thread() -> Generator[None]:
    """Hold every BLAS of this process to one thread.

    Its threads wait for each other by spinning: on cores that others use too that cost a factor
    of a hundred, measured, and sums over several threads come out in another order each time.
    Entering and leaving takes some microseconds; what was set before is set again.
    """
    with _controller().limit(limits=1, user_api="blas"):
        yield


@cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()
