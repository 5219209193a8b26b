"""Waiting until a message is due, nearly all of the time asleep."""

from collections.abc import Callable

from fras_replay.recording import NS

__all__ = ["SPIN_NS", "wait_s"]

# A sleeper is woken 0.1 ms late or so, so it looks at the clock for the last of its way. No longer
# than that: who spins uses its share of a busy processor up, and is then made to wait for 4 ms in
# mid-schedule (measured beside other work, one to four runs each: with 0 / 0.1 / 0.5 / 2 ms of
# spinning p99 3.0 to 5.2 / 3.1 to 3.2 / 2.6 to 5.3 / 4.3 ms, and 2 ms or so late already for one
# message in 10 with 0.5 ms; median 0.13 / 0.05 / 0.05 / 0.09 ms).
SPIN_NS = 100_000


def wait_s(next_ns: int | None, clock_ns: Callable[[], int]) -> float | None:
    """Return for how long to sleep [s]; 0 once `next_ns` has come, for which the last bit is spun.

    Parameters
    ----------
    next_ns : int or None [ns]
        By the clock; None if nothing becomes due by itself, and then nor does the answer.
    clock_ns : callable
        Returns monotonic nanoseconds.
    """
    if next_ns is None:
        return None
    gap_ns = next_ns - clock_ns()
    if gap_ns > SPIN_NS:
        return (gap_ns - SPIN_NS) / NS
    while clock_ns() < next_ns:
        pass
    return 0.0
