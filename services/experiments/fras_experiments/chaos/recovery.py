"""How long nothing moved after a fault: pure, from the times of the ticks."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

STALL_S: Final = 0.25
"""A shorter pause between two ticks is none: planning, a context, a busy machine."""


@dataclass(frozen=True)
class Stall:
    """From one tick to the next one, which took long [ns since the Unix epoch]."""

    from_ns: int
    to_ns: int


def stalls(times_ns: Sequence[int]) -> tuple[Stall, ...]:
    """Find where the ticks stood still.

    Parameters
    ----------
    times_ns : sequence of int
        When each tick was first told, in the order of the ticks.
    """
    long_ns = STALL_S * 1e9
    return tuple(Stall(a, b) for a, b in pairwise(times_ns) if b - a >= long_ns)


def recovery_s(at_ns: int, until_ns: int, found: Sequence[Stall]) -> float | None:
    """Tell how long a fault kept the ticks from going on; None if it did not.

    Notes
    -----
    From the fault, or from the last tick that was under way then, to the next tick: of the first
    stall that ends after the fault at `at_ns` and begins before `until_ns`, where the next fault
    is.
    """
    for stall in found:
        if stall.to_ns > at_ns and stall.from_ns < until_ns:
            return (stall.to_ns - max(at_ns, stall.from_ns)) * 1e-9
    return None
