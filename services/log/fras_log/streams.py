"""What each publisher sent on each key: which samples are copies, and how many are missing."""

from collections import OrderedDict, deque
from collections.abc import Mapping
from types import MappingProxyType

from fras_common.codec import HeaderFields
from fras_common.keeping import is_of_ours

__all__ = ["Streams"]

# As many as a publisher's cache can send again.
REMEMBERED = 2000
# A service has another name each time it starts, and anybody may make up any number of both.
SOURCES = 64
OTHER_KEYS = 1024

Ends = Mapping[str, Mapping[str, int]]
"""The last number by key and publisher."""


class Streams:
    """Numbers and stamps of the latest samples by key and publisher.

    Of each key so many publishers are known, and so many keys besides those of our own services;
    then who was silent for longest is forgotten: what it sends next counts as its first. A flood
    of names on one key makes nobody be forgotten on another.

    Parameters
    ----------
    before : mapping of str to mapping of str to int
        The last numbers, by key and publisher, of samples that are not noted here.
    """

    def __init__(self, before: Ends = MappingProxyType({})) -> None:
        self._keys: dict[str, _Publishers] = {}
        self._others: OrderedDict[str, _Publishers] = OrderedDict()
        for key, ends in before.items():
            for source, last in ends.items():
                _add(self._publishers(key), source, _Stream(last))

    @property
    def ends(self) -> dict[str, dict[str, int]]:
        """The last numbers by key and publisher."""
        found: dict[str, dict[str, int]] = {}
        for key, publishers in (*self._keys.items(), *self._others.items()):
            for source, stream in publishers.items():
                if stream.highest is not None:
                    found.setdefault(key, {})[source] = stream.highest
        return found

    def note(self, key: str, header: HeaderFields) -> int | None:
        """Take a sample into account.

        A copy has number and stamp of a sample that came before; a lower number alone is no
        reason to leave anything out of the log, whoever sent what before it.

        Returns
        -------
        int or None
            How many samples are missing before this one; None if it is a copy.
        """
        publishers = self._publishers(key)
        stream = publishers.get(header.source)
        if stream is None:
            stream = _Stream(None)
            _add(publishers, header.source, stream)
        else:
            publishers.move_to_end(header.source)
        return stream.note(header)

    def precedes(self, key: str, header: HeaderFields) -> bool:
        """Whether a sample was sent before the first one of its publisher that was noted here."""
        publishers = self._keys.get(key) or self._others.get(key)
        stream = publishers.get(header.source) if publishers is not None else None
        return stream is not None and stream.precedes(header.seq)

    def _publishers(self, key: str) -> "_Publishers":
        """Find the publishers of a key; it is now the one that spoke last."""
        if is_of_ours(key):
            return self._keys.setdefault(key, OrderedDict())
        publishers = self._others.setdefault(key, OrderedDict())
        self._others.move_to_end(key)
        if len(self._others) > OTHER_KEYS:
            self._others.popitem(last=False)
        return publishers


def _add(publishers: "_Publishers", source: str, stream: "_Stream") -> None:
    publishers[source] = stream
    if len(publishers) > SOURCES:
        publishers.popitem(last=False)


class _Stream:
    def __init__(self, before: int | None) -> None:
        self.highest = before
        self._before = before
        self._first: int | None = None
        self._last = before
        self._order: deque[tuple[int, int]] = deque()
        self._recent: set[tuple[int, int]] = set()

    def note(self, header: HeaderFields) -> int | None:
        seq = header.seq
        name = (seq, header.stamp_ns)
        recent, order = self._recent, self._order
        if name in recent:
            return None
        order.append(name)
        recent.add(name)
        if len(order) > REMEMBERED:
            recent.discard(order.popleft())
        if self._first is None or seq < self._first:
            self._first = seq
        if self.highest is None or seq > self.highest:
            self.highest = seq
        last, self._last = self._last, seq
        if last is None or seq <= last + 1:
            return 0
        # What is between them may have come earlier, before one that came late.
        return seq - last - 1 - len({one for one, _ in recent if last < one < seq})

    def precedes(self, seq: int) -> bool:
        first, before = self._first, self._before
        return (first is not None and seq < first) or (before is not None and seq <= before)


_Publishers = OrderedDict[str, _Stream]
