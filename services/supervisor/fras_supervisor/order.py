"""In which order processes start and stop: pure functions on names."""

from collections.abc import Collection, Mapping
from graphlib import CycleError, TopologicalSorter
from typing import Protocol


class Ordered(Protocol):
    """What ordering needs to know of a process."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Names that must be ready before it starts."""
        ...

    @property
    def outlives(self) -> tuple[str, ...]:
        """Names that must have ended before it is asked to stop."""
        ...


def find_cycle(before: Mapping[str, Collection[str]]) -> tuple[str, ...]:
    """Find names that wait for each other in a ring.

    Parameters
    ----------
    before : mapping of name to names
        Who comes before whom.

    Returns
    -------
    tuple of str
        The ring, first name repeated at its end, each name waiting for the next one; empty if
        there is none.
    """
    try:
        TopologicalSorter(before).prepare()
    except CycleError as error:
        # graphlib lists the ring from predecessor to successor; "waits for" reads the other way.
        return tuple(reversed(error.args[1]))
    return ()


def topological(before: Mapping[str, Collection[str]]) -> tuple[str, ...]:
    """Sort names so that each follows all that come before it, else keeping their given order.

    Parameters
    ----------
    before : mapping of name to names
        Who comes before whom; free of cycles and of unknown names (`load_table` sees to it).

    Returns
    -------
    tuple of str
        All names. Stable: of those that are free to come next, the first given comes first.
    """
    placed: dict[str, None] = {}
    while len(placed) < len(before):
        following = next(
            name
            for name, earlier in before.items()
            if name not in placed and all(one in placed for one in earlier)
        )
        placed[following] = None
    return tuple(placed)


def start_order(processes: Mapping[str, Ordered]) -> tuple[str, ...]:
    """Order of launching: each process after all that it needs, else as in the file."""
    return topological({name: process.needs for name, process in processes.items()})


def ended_before(processes: Mapping[str, Ordered]) -> dict[str, frozenset[str]]:
    """Say for each process who must have ended before it is asked to stop.

    These are the processes that need it, and those that it `outlives`. The keys come in reverse
    order of start, so that `topological` of the result is the order of stopping.
    """
    return {
        name: frozenset(other for other, process in processes.items() if name in process.needs)
        | frozenset(processes[name].outlives)
        for name in reversed(start_order(processes))
    }
