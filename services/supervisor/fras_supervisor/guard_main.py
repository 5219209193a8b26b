"""The last one out: ends what a killed supervisor left behind.

A script of its own that imports nothing but the standard library, so that it is there within
milliseconds. It reads process ids, one a line, from its standard input, and when that ends
(because the supervisor ended, even by SIGKILL) it gives those processes some time to end by
themselves and then kills their process groups.
"""

import os
import signal
import sys
import time
from pathlib import Path

POLL_S = 0.02


def start_time(pid: int) -> str | None:
    """Start of a process in clock ticks since boot (proc(5), stat, field 22), or nothing."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text("ascii", errors="replace")
    except OSError:
        return None
    return stat.rpartition(")")[2].split()[19]


def lives(pid: int, started: str | None) -> bool:
    """Tell whether the process group that `pid` leads, or led, still has a member.

    A process id may have been given to somebody else in the meantime; the start time tells.
    """
    try:
        os.killpg(pid, 0)
    except (ProcessLookupError, PermissionError):
        return False
    return start_time(pid) in (None, started)


def main() -> None:
    """Wait for the supervisor's end, then see to it that its children end too."""
    grace_s = float(sys.argv[1])
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    watched = {int(line): start_time(int(line)) for line in sys.stdin}
    for pid in (pid for pid, started in watched.items() if lives(pid, started)):
        os.killpg(pid, signal.SIGCONT)  # one that is frozen could not see our end
    deadline = time.monotonic() + grace_s
    while left := [pid for pid, started in watched.items() if lives(pid, started)]:
        if time.monotonic() >= deadline:
            for pid in left:
                os.killpg(pid, signal.SIGKILL)
            return
        time.sleep(POLL_S)


if __name__ == "__main__":
    main()
