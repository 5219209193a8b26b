"""One BLAS thread everywhere, before numpy is imported: two threads give other bits than one."""

import os

for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"
