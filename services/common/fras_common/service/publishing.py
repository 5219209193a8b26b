"""A publisher whose puts are counted."""

from collections import Counter
from typing import Generic, TypeVar

from fras_common.bus import Publisher
from fras_common.messages import Header

M = TypeVar("M", bound=Header)


class CountingPublisher(Generic[M]):
    """Counts as `published` what it puts.

    Parameters
    ----------
    counts : Counter
    inner : Publisher
    """

    def __init__(self, counts: Counter[str], inner: Publisher[M]) -> None:
        self._counts = counts
        self._inner = inner

    def put(self, message: M) -> M:
        """Count, and publish."""
        self._counts["published"] += 1
        return self._inner.put(message)
