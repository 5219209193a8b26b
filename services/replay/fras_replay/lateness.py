"""How late messages went out."""

from array import array

import numpy as np

NS_PER_MS = 1e6


class Lateness:
    """Collects how long after it was due each message was handed to the bus."""

    def __init__(self) -> None:
        self._ns: array[int] = array("q")

    def note(self, ns: int) -> None:
        """Take one into account [ns]."""
        self._ns.append(ns)

    def __len__(self) -> int:
        return len(self._ns)

    def percentile_ms(self, percent: float) -> float:
        """Return a percentile [ms]; 0 where nothing went out."""
        if not self._ns:
            return 0.0
        return float(np.percentile(np.array(self._ns), percent)) / NS_PER_MS
