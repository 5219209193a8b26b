"""A service with a wall clock that can be set: stands where `python -m fras_sim` would.

What libfaketime does to a program, done to a Python program: `time.time` and `time.time_ns` are
moved by what a small file says, before the service is imported, and whenever the file changes.
The product knows nothing of it. What is not moved: monotonic clocks, which a jump of the wall clock
does not move either, and the clock inside the Zenoh library.
"""

import mmap
import runpy
import struct
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

FORMAT: Final = struct.Struct("<q")
LAUNCH: Final = "from fras_experiments.chaos.clocked import main; main()"
"""For `python -c`; behind it the clock's file, the module, the module's arguments."""


def set_clock(path: Path, offset_ns: int) -> None:
    """Set how far a clock is ahead; at once for a service that runs with it."""
    if not path.exists():
        path.write_bytes(FORMAT.pack(offset_ns))
        return
    with path.open("r+b") as file, mmap.mmap(file.fileno(), FORMAT.size) as memory:
        FORMAT.pack_into(memory, 0, offset_ns)


def moved(clock_ns: Callable[[], int], offset_ns: Callable[[], int]) -> Callable[[], int]:
    """Return a clock that is ahead of another one."""
    return lambda: clock_ns() + offset_ns()


def main() -> None:
    """Run a module with the clock of a file."""
    path, module, *arguments = sys.argv[1:]
    with Path(path).open("r+b") as file:
        memory = mmap.mmap(file.fileno(), FORMAT.size)
    now_ns = moved(time.time_ns, lambda: FORMAT.unpack_from(memory, 0)[0])
    time.time_ns = now_ns
    time.time = lambda: now_ns() * 1e-9
    sys.argv = [module, *arguments]
    runpy.run_module(module, run_name="__main__", alter_sys=True)
