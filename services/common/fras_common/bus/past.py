"""All that publishers still cache, asked for piece by piece.

A cache of tissue states is tens of megabytes. A publisher that must say it all at once has no way
left for what it has to say now: on a busy machine its health did not come through for so long that
it was taken for hung, and ended, and with it went the cache (found by `fras chaos`).
"""

import threading
import time
from collections import defaultdict, deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

from fras_common.bus.contract import RawSample
from fras_common.keeping import kept_of

__all__ = ["Cached", "Get", "Past"]

PIECE_BYTES: Final = 2**20
PIECE_SAMPLES: Final = 256
AT_ONCE: Final = 4
"""Pieces under way; each is another publisher's, or the next of the same."""
PIECE_SHARE: Final = 0.25
"""Of the whole time: a publisher that is frozen must not use it up for all."""
EARLIEST_S: Final = 0.1
"""The least that a question may take; the library takes none for without end."""


@dataclass(frozen=True)
class Cached:
    """A sample out of a publisher's cache.

    Attributes
    ----------
    publisher : str
        How its cache is asked for, beside the key: `<session>/<entity>`.
    number : int
        Which of the publisher's samples it is; they are numbered without holes.
    """

    sample: RawSample
    publisher: str
    number: int


Get = Callable[[str, Callable[[Cached], None], Callable[[], None], float], None]
"""Asks a selector: what takes each reply, what is told the end, and how long it may take [s]."""


class Past:
    """One question for all that is cached.

    First each publisher is asked for its latest sample, which tells how many there are and how
    large they are; then for those before it.

    Parameters
    ----------
    get : callable
        May call back on any thread.
    on_done : callable
        Gets what came in time, each publisher's in order.
    timeout_s : float
        For all pieces together.
    clock_s : callable
        Monotonic.
    """

    def __init__(
        self,
        get: Get,
        on_done: Callable[[list[RawSample]], None],
        timeout_s: float,
        clock_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._get = get
        self._on_done = on_done
        self._clock_s = clock_s
        self._by_s = clock_s() + timeout_s
        self._piece_s = timeout_s * PIECE_SHARE
        self._found: dict[tuple[str, str], list[Cached]] = defaultdict(list)
        self._pieces: deque[str] = deque()
        self._under_way = 0
        self._lock = threading.Lock()

    def ask(self, key_expr: str) -> None:
        """Begin."""
        # Where an advanced publisher answers for its cache.
        self._get(f"{key_expr}/@adv/**?_max=1", self._note, self._begin, self._piece_s)

    def _note(self, one: Cached) -> None:
        with self._lock:
            self._found[one.sample.key, one.publisher].append(one)

    def _begin(self) -> None:
        with self._lock:
            self._pieces.extend(
                piece for found in self._found.values() for piece in pieces_before(found[-1])
            )
        self._go_on(ended=0)

    def _go_on(self, ended: int = 1) -> None:
        with self._lock:
            self._under_way -= ended
            if self._left_s() <= 0.0:
                self._pieces.clear()
            following: list[str] = []
            while self._pieces and self._under_way < AT_ONCE:
                following.append(self._pieces.popleft())
                self._under_way += 1
            is_done = self._under_way == 0
        for selector in following:
            allowed_s = min(self._piece_s, max(self._left_s(), EARLIEST_S))
            self._get(selector, self._note, self._go_on, allowed_s)
        if is_done:
            self._finish()

    def _finish(self) -> None:
        found = [sorted(one, key=lambda cached: cached.number) for one in self._found.values()]
        self._on_done([cached.sample for one in found for cached in one])

    def _left_s(self) -> float:
        return self._by_s - self._clock_s()


def pieces_before(latest: Cached) -> Iterator[str]:
    """Tell the selectors of what a publisher may have cached before its latest sample."""
    key, end = latest.sample.key, latest.number
    fitting = PIECE_BYTES // max(1, len(latest.sample.payload))
    step = min(max(1, fitting), PIECE_SAMPLES)
    for first in range(max(0, end + 1 - kept_of(key)), end, step):
        last = min(first + step, end) - 1
        yield f"{key}/@adv/pub/{latest.publisher}/**?_sn={first}..{last}"
