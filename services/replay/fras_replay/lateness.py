"""How late messages went out."""

from array import array

import numpy as np
from numpy.typing import NDArray

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
        return float(np.percentile(self.ms(), percent)) if self._ns else 0.0

    def ms(self) -> NDArray[np.float64]:
        """Return all of them, in their order [ms]."""
        return np.array(self._ns, dtype=np.float64) / NS_PER_MS
