"""Whether what a process uses stays flat from trial to trial: pure, from a series of samples."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

BOUNDS: Final[Mapping[str, float]] = {
    "memory_mib": 0.05,
    "descriptors": 0.02,
    "threads": 0.02,
    "files": 0.02,
    "gaps": 0.02,
    "dropped": 0.02,
    "malformed": 0.02,
    "refused": 0.02,
    "logs_mib": 0.01,
}
"""The most by which a quantity may rise with each trial, in the median of all pairs of trials.

Of what is counted in whole numbers: one in fifty trials. Of memory: 50 MiB in a thousand."""


@dataclass(frozen=True)
class Judged:
    """A quantity of one process over all trials.

    Attributes
    ----------
    first, middle, last : float
        After the first trial, after half of them, after the last.
    slope : float
        Rise with each trial over the second half.
    bound : float
        The most that it may be.
    """

    process: str
    quantity: str
    first: float
    middle: float
    last: float
    slope: float
    bound: float

    @property
    def is_flat(self) -> bool:
        """Whether it does not rise."""
        return self.slope <= self.bound


def rise(values: Sequence[float]) -> float:
    """Return the median of the slopes of all pairs (Theil and Sen): few outliers do not move it.

    Parameters
    ----------
    values : sequence of float
        One for each trial; a single one has no slope: 0.
    """
    series = np.asarray(values, dtype=np.float64)
    before, after = np.triu_indices(len(series), k=1)
    if not len(before):
        return 0.0
    return float(np.median((series[after] - series[before]) / (after - before)))


def judge(process: str, quantity: str, values: Sequence[float]) -> Judged:
    """Judge a series by its second half: caches fill in the first.

    Raises
    ------
    KeyError
        There is no bound for the quantity.
    """
    middle = len(values) // 2
    slope = rise(values[middle:])
    return Judged(process, quantity, values[0], values[middle], values[-1], slope, BOUNDS[quantity])
