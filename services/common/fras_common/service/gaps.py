"""What is missing between the messages of a stream, by their numbers."""

from collections import OrderedDict
from typing import Final

STREAMS: Final = 1024
"""A service has another name each time it starts, and anybody may make up any number of them."""


class Gaps:
    """Remembers the last number of each stream; of too many, not who was silent for longest."""

    def __init__(self) -> None:
        self._last: OrderedDict[tuple[str, str], int] = OrderedDict()

    @property
    def known(self) -> int:
        """How many streams are remembered."""
        return len(self._last)

    def before(self, key: str, source: str, seq: int) -> int:
        """Count what is missing before a message; none before the first of its stream."""
        stream = (key, source)
        last = self._last.get(stream, seq)
        self._last[stream] = max(last, seq)
        self._last.move_to_end(stream)
        if len(self._last) > STREAMS:
            self._last.popitem(last=False)
        return max(0, seq - last - 1)
