"""What a process may use: open files and niceness, set by us as soon as it is launched.

Not by code between fork and exec: that is not safe in a program with threads. Memory is watched
instead (`Stack.kill`): the kernel can limit address space alone, of which compiled kernels and
memory maps take many times what they use.
"""

import os
import resource

from fras_supervisor.errors import LimitRefused
from fras_supervisor.table import Process


def apply_limits(process: Process, pid: int) -> None:
    """Set the limits of a process that has just been launched; nothing if it has ended already.

    Raises
    ------
    LimitRefused
        The system does not let us.
    """
    try:
        if (files := process.open_files_limit) > 0:
            resource.prlimit(pid, resource.RLIMIT_NOFILE, (files, files))
        if process.nice != 0:
            nice = os.getpriority(os.PRIO_PROCESS, pid) + process.nice
            os.setpriority(os.PRIO_PROCESS, pid, nice)
    except ProcessLookupError:
        return
    except (PermissionError, ValueError) as error:
        limits = f"open_files_limit = {process.open_files_limit}, nice = {process.nice}"
        raise LimitRefused(process.name, limits, str(error)) from error
