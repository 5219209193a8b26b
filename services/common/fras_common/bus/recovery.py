"""Samples of many publishers, each one's in order, and whole as far as its cache goes.

Zenoh's own recovery gives up what is lost while it asks for an earlier loss (found by
`fras chaos`), and it asks whom it hears for the first time for the whole cache.
"""

from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from fras_common.bus.contract import RawSample
from fras_common.bus.past import Cached, cache_selector, piece_length
from fras_common.keeping import kept_of

__all__ = ["ALL_OF_WHO_BEGINS", "Ask", "Earlier", "Recovery"]

PATIENCE_S: Final = 0.02
"""What is missing may be just behind."""
RETRY_S: Final = 0.25
GIVE_UP_S: Final = 2.5
"""A publisher that has gone does not answer; less than a log waits for as it is closed."""
SETTLING_S: Final = 1.0
"""Who is heard first so soon has spoken before; who is heard first later has just begun."""
WAITING: Final = 1000
"""What waits behind a hole, by publisher."""
WAITING_BYTES: Final = 64 * 2**20
"""Of all publishers together."""
PUBLISHERS: Final = 4096


@dataclass(frozen=True)
class Earlier:
    """How many messages of a publisher are told that it said before it was heard.

    Attributes
    ----------
    of_who_was_there : int
        Of one that is heard within the first second.
    of_who_comes : int
        Of one that is heard later.
    """

    of_who_was_there: int
    of_who_comes: int


ALL_OF_WHO_BEGINS: Final = Earlier(0, 64)
"""From now on, and what a publisher that has just begun may have said unheard."""


@dataclass
class _Stream:
    key: str
    publisher: str
    last: int
    """The number up to which all is told, or given up."""
    highest: int
    """The latest number, as far as it is known."""
    kept: int
    size: int = 0
    waiting: dict[int, RawSample] = field(default_factory=dict[int, RawSample])
    since_s: float | None = None
    """When the hole was noticed, or last became smaller."""
    ask_at_s: float | None = None


@dataclass(frozen=True)
class Ask:
    """A question to a publisher's cache; `Recovery.answered` gets it back at its end."""

    selector: str
    stream: _Stream
    found: list[Cached] = field(default_factory=list[Cached])


class Recovery:
    """What was heard, in order, and what has to be asked for.

    Parameters
    ----------
    clock_s : callable
        Monotonic.
    earlier : Earlier
        What is told of before.

    Attributes
    ----------
    told : deque of RawSample
        What can be told on; whoever does it takes it out.

    Notes
    -----
    A publisher numbers its samples without holes, and repeats its latest number. What stands
    behind a hole waits for what the cache gives, or until nobody answers for it. A number that
    comes again is told again: whoever listens knows copies better, and nobody can hide another's
    words behind a high number.
    """

    def __init__(self, clock_s: Callable[[], float], earlier: Earlier = ALL_OF_WHO_BEGINS) -> None:
        self.told: deque[RawSample] = deque()
        self._clock_s = clock_s
        self._earlier = earlier
        self._settled_s = clock_s() + SETTLING_S
        self._streams: OrderedDict[tuple[str, str], _Stream] = OrderedDict()
        self._holes: dict[tuple[str, str], _Stream] = {}
        self._waiting_bytes = 0

    def note(self, heard: Cached) -> None:
        """Take in what a publisher has just said."""
        number, sample = heard.number, heard.sample
        stream = self._stream(sample.key, heard.publisher, number, at_least=1)
        stream.size = len(sample.payload)
        stream.highest = max(stream.highest, number)
        if number <= stream.last:
            self.told.append(sample)
            return
        self._wait(stream, heard)
        if len(stream.waiting) > WAITING or self._waiting_bytes > WAITING_BYTES:
            _pass_over(stream)
        self._tell(stream)

    def note_earlier(self, found: Cached) -> None:
        """Take in what a cache had without being asked for a hole."""
        stream = self._stream(found.sample.key, found.publisher, found.number, at_least=1)
        if found.number > stream.last:
            self.note(found)

    def note_latest(self, key: str, publisher: str, number: int) -> None:
        """Take in which number was a publisher's latest."""
        stream = self._stream(key, publisher, number)
        if number > stream.highest:
            stream.highest = number
            self._tell(stream)

    def due_s(self) -> float | None:
        """Tell when something has to be asked for next, by the clock."""
        due = [one.ask_at_s for one in self._holes.values() if one.ask_at_s is not None]
        return min(due, default=None)

    def questions(self) -> list[Ask]:
        """Tell what has to be asked for now, a piece of each cache at a time."""
        now_s = self._clock_s()
        asks: list[Ask] = []
        for stream in self._holes.values():
            if stream.ask_at_s is None or stream.ask_at_s > now_s:
                continue
            stream.ask_at_s = None
            end = min(stream.waiting, default=stream.highest + 1)
            last = min(end - 1, stream.last + piece_length(stream.size))
            selector = cache_selector(stream.key, stream.publisher, stream.last + 1, last)
            asks.append(Ask(selector, stream))
        return asks

    def answered(self, ask: Ask) -> None:
        """Take in what a cache had, once all of it has come."""
        stream, now_s = ask.stream, self._clock_s()
        for one in ask.found:
            if one.number > stream.last:
                self._wait(stream, one)
        if ask.found:
            # Even a part of it: what a link was too full for may come the next time.
            stream.since_s = None
        elif stream.since_s is not None and now_s - stream.since_s >= GIVE_UP_S:
            _pass_over(stream)
        self._tell(stream, in_s=0.0 if ask.found else RETRY_S, anew=True)

    def _stream(self, key: str, publisher: str, number: int, *, at_least: int = 0) -> _Stream:
        """Find a publisher; of a new one at least so many messages up to `number` are told."""
        name = (key, publisher)
        if (stream := self._streams.get(name)) is not None:
            self._streams.move_to_end(name)
            return stream
        kept = kept_of(key)
        is_settled = self._clock_s() >= self._settled_s
        earlier = self._earlier.of_who_comes if is_settled else self._earlier.of_who_was_there
        before = max(-1, number - max(at_least, min(kept, earlier)))
        stream = self._streams[name] = _Stream(key, publisher, before, before, kept)
        if len(self._streams) > PUBLISHERS:
            _, forgotten = self._streams.popitem(last=False)
            while forgotten.waiting:
                _pass_over(forgotten)
                self._tell(forgotten)
            self._holes.pop((forgotten.key, forgotten.publisher), None)
        return stream

    def _wait(self, stream: _Stream, heard: Cached) -> None:
        if heard.number not in stream.waiting:
            stream.waiting[heard.number] = heard.sample
            self._waiting_bytes += len(heard.sample.payload)

    def _tell(self, stream: _Stream, in_s: float = PATIENCE_S, *, anew: bool = False) -> None:
        """Tell what follows upon what was told; if anything is missing then, it is asked for."""
        oldest = stream.highest + 1 - stream.kept
        while True:
            while (following := stream.waiting.pop(stream.last + 1, None)) is not None:
                stream.last += 1
                self._waiting_bytes -= len(following.payload)
                self.told.append(following)
            if stream.last + 1 >= oldest:
                break
            # The cache holds it no more.
            stream.last = min(oldest, min(stream.waiting, default=oldest)) - 1
        name = (stream.key, stream.publisher)
        if stream.last >= stream.highest:
            stream.since_s = stream.ask_at_s = None
            self._holes.pop(name, None)
        elif anew or name not in self._holes:
            self._holes[name] = stream
            now_s = self._clock_s()
            stream.ask_at_s = now_s + in_s
            stream.since_s = now_s if stream.since_s is None else stream.since_s


def _pass_over(stream: _Stream) -> None:
    """Go on behind the hole; what only a number was heard of is not waited for."""
    if stream.waiting:
        stream.last = min(stream.waiting) - 1
    else:
        stream.highest = stream.last
