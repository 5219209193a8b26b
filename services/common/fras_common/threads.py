"""One thread in every numerical library.

Sums over several threads come out in another order each time, and so do their last bits; and six
processes share few cores.
"""

import os
from typing import Final

ONE_THREAD: Final = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
    # The same bits from MKL on any CPU and alignment.
    "MKL_CBWR": "COMPATIBLE",
}


def one_thread() -> None:
    """Set the environment of this process; only libraries imported after this follow it."""
    os.environ.update(ONE_THREAD)
