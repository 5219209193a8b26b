"""How much memory this process uses, and used at most."""

import re
import resource
from pathlib import Path
from typing import Literal


def memory_mib(field: Literal["VmRSS", "VmHWM"]) -> float:
    """Return what is resident now (VmRSS), or was at most (VmHWM) [MiB].

    Not from `getrusage`: the peak that it tells of a child starts with the parent's.
    """
    try:
        found = re.search(rf"{field}:\s+(\d+)", Path("/proc/self/status").read_text())
    except OSError:
        found = None
    kib = int(found[1]) if found else resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return kib / 1024
