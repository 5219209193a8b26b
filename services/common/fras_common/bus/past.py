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
from functools import partial
from typing import Final

from fras_common.bus.contract import RawSample
from fras_common.keeping import kept_of

__all__ = [
    "CACHES",
    "Beat",
    "Cached",
    "Get",
    "Past",
    "cache_selector",
    "latest_selector",
    "piece_length",
]

CACHES: Final = "/@adv/pub/"
"""Between the key and `<session>/<entity>` of an advanced publisher: where it answers for its
cache, and says the latest number."""
PIECE_BYTES: Final = 2**20
PIECE_SAMPLES: Final = 256
AT_ONCE: Final = 4
"""Pieces under way; each is another publisher's, or the next of the same."""
PIECE_SHARE: Final = 0.25
"""Of the whole time: a publisher that is frozen must not use it up for all."""
TRIES: Final = 2
"""How often is asked what gives nothing new, or what somebody has not answered in time."""
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


@dataclass(frozen=True)
class Beat:
    """A publisher's word on the number of its latest sample."""

    key: str
    publisher: str
    number: int


@dataclass
class _Piece:
    selector: str
    missing: int = 0
    tries: int = 0
    has_come: bool = False
    """Whether the latest try gave anything new."""


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
        self._found: dict[tuple[str, str], dict[int, Cached]] = defaultdict(dict)
        self._pieces: deque[_Piece] = deque()
        self._under_way = 0
        self._lock = threading.Lock()

    def ask(self, key_expr: str) -> None:
        """Begin."""
        self._ask_first(_Piece(latest_selector(key_expr)))

    def _ask_first(self, first: _Piece) -> None:
        by_s = self._clock_s() + self._piece_s - EARLIEST_S
        self._ask(first, partial(self._begin, first, len(self._found), by_s))

    def _begin(self, first: _Piece, known: int, by_s: float) -> None:
        is_late = self._clock_s() >= by_s and first.tries < TRIES
        if self._left_s() > 0.0 and (is_late or len(self._found) > known):
            # Somebody has not answered in time, or may have found the link too full.
            self._ask_first(first)
            return
        with self._lock:
            latest = [max(found.items())[1] for found in self._found.values()]
            self._pieces.extend(one for each in latest for one in pieces_before(each))
        self._go_on()

    def _ask(self, piece: _Piece, on_end: Callable[[], None]) -> None:
        def note(one: Cached) -> None:
            with self._lock:
                found = self._found[one.sample.key, one.publisher]
                piece.missing -= one.number not in found
                piece.has_come |= one.number not in found
                found[one.number] = one

        piece.tries += 1
        piece.has_come = False
        allowed_s = min(self._piece_s, max(self._left_s(), EARLIEST_S))
        self._get(piece.selector, note, on_end, allowed_s)

    def _end(self, piece: _Piece) -> None:
        with self._lock:
            self._under_way -= 1
            if piece.missing > 0 and (piece.has_come or piece.tries < TRIES):
                # A publisher that was too busy, or a link that was too full, may do it now.
                self._pieces.append(piece)
        self._go_on()

    def _go_on(self) -> None:
        with self._lock:
            if self._left_s() <= 0.0:
                self._pieces.clear()
            following: list[_Piece] = []
            while self._pieces and self._under_way < AT_ONCE:
                following.append(self._pieces.popleft())
                self._under_way += 1
            is_done = self._under_way == 0
        for piece in following:
            self._ask(piece, partial(self._end, piece))
        if is_done:
            self._finish()

    def _finish(self) -> None:
        found = [sorted(one.items()) for one in self._found.values()]
        self._on_done([cached.sample for one in found for _, cached in one])

    def _left_s(self) -> float:
        return self._by_s - self._clock_s()


def latest_selector(key_expr: str) -> str:
    """Tell where each advanced publisher answers with its latest sample."""
    return f"{key_expr}{CACHES}**?_max=1"


def pieces_before(latest: Cached) -> Iterator[_Piece]:
    """Tell the pieces of what a publisher may have cached before its latest sample."""
    key, end = latest.sample.key, latest.number
    step = piece_length(len(latest.sample.payload))
    for first in range(max(0, end + 1 - kept_of(key)), end, step):
        last = min(first + step, end) - 1
        yield _Piece(cache_selector(key, latest.publisher, first, last), last + 1 - first)


def piece_length(payload_bytes: int) -> int:
    """Tell how many samples of a length make a piece."""
    return min(max(1, PIECE_BYTES // max(1, payload_bytes)), PIECE_SAMPLES)


def cache_selector(key: str, publisher: str, first: int, last: int) -> str:
    """Tell where an advanced publisher answers for these numbers of its samples."""
    return f"{key}{CACHES}{publisher}/**?_sn={first}..{last}"
