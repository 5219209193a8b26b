"""What has arrived since the last look: bounded, whatever comes, and never in the bus's way."""

import threading
from collections import deque
from collections.abc import Hashable
from typing import Final

WAITING: Final = 5_000


class Mail:
    """Collects messages on the bus's threads for one reader.

    Of what is replaced by the next one (a state of the tissue) only the latest is kept; the rest
    waits in order, at most `WAITING` of it: then the oldest goes, and is counted.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._latest: dict[Hashable, tuple[object, float]] = {}
        self._waiting: deque[tuple[object, float]] = deque()
        self.received = 0
        self.dropped = 0

    def replace(self, key: Hashable, message: object, now_s: float) -> None:
        """Keep a message until the next of its key comes."""
        with self._lock:
            self.received += 1
            self._latest[key] = (message, now_s)

    def append(self, message: object, now_s: float) -> None:
        """Keep a message behind those that wait."""
        with self._lock:
            self.received += 1
            if len(self._waiting) >= WAITING:
                self._waiting.popleft()
                self.dropped += 1
            self._waiting.append((message, now_s))

    def take(self) -> list[tuple[object, float]]:
        """Return what has arrived, with its times, oldest first, and begin anew."""
        with self._lock:
            taken = [*self._waiting, *self._latest.values()]
            self._waiting.clear()
            self._latest.clear()
        return sorted(taken, key=lambda one: one[1])
