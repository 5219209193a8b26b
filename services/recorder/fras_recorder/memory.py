"""The last messages of each key, by which a service that starts again finds its state."""

import threading
from collections import OrderedDict, deque
from collections.abc import Callable, Sequence
from itertools import accumulate

from fras_common.bus import RawSample
from fras_common.codec import read_header
from fras_common.keeping import is_of_ours, kept_of
from fras_common.messages import SinceReply
from fras_common.provenance import producers_of

__all__ = ["Memory"]

# Of one key: 1,000 tissue states are some 40 MB.
BYTES = 64 * 2**20
# Of all keys together that no service of ours has: anybody may make up any number of them.
OTHER_KEYS = 256
OTHER_BYTES = 64 * 2**20
# Of one key: who has spoken there. A service that starts again is another source.
SOURCES = 64
# Of one reply: it is mirrored, and so stands in the log.
REPLY_BYTES = 4 * 2**20


class Memory:
    """Remembers what was said on each key; noted on the receiving thread, asked on any.

    Of keys that no service of ours has, the one that was silent for longest is forgotten when
    there are too many, or what was said on them is too much.

    Parameters
    ----------
    bytes_ : int
        The most that is kept of one key; the last message always is.
    kept : callable
        The most messages that are kept of a key, by its name.
    """

    def __init__(self, bytes_: int = BYTES, kept: Callable[[str], int] = kept_of) -> None:
        self._bytes = bytes_
        self._kept = kept
        self._keys: dict[str, _Recent] = {}
        self._others: OrderedDict[str, _Recent] = OrderedDict()
        self._other_bytes = 0
        self._lock = threading.Lock()

    def note(
        self, key: str, payload: bytes, present: Callable[[str], bool] = lambda source: True
    ) -> bool:
        """Take a message, unless it was said before; tells whether it was new.

        What is sent again must not become what a service that starts again takes for the last: of
        one source numbers rise, and one that was never heard has either said it after the last that
        was, or is here now.

        Parameters
        ----------
        key : str
        payload : bytes
        present : callable
            Whether a source is here.
        """
        header = read_header(payload)
        with self._lock:
            recent = self._recent(key)
            if header is not None and header.source and producers_of(key) is not None:
                last = recent.numbers.get(header.source)
                if last is not None and header.seq <= last:
                    return False
                older = last is None and header.stamp_ns < recent.stamp_ns
                if older and not present(header.source):
                    return False
            self._append(key, payload)
            return True

    def precede(self, samples: Sequence[RawSample]) -> None:
        """Take what was said before anything was noted; it may overlap with that."""
        with self._lock:
            noted = {**self._keys, **self._others}
            self._keys, self._others, self._other_bytes = {}, OrderedDict(), 0
            for sample in samples:
                self._append(sample.key, sample.payload)
            for key, recent in noted.items():
                known = set(self._recent(key).payloads)
                for payload in recent.payloads:
                    if payload not in known:
                        self._append(key, payload)

    def _append(self, key: str, payload: bytes) -> None:
        if is_of_ours(key):
            recent = self._keys.setdefault(key, _Recent(self._kept(key)))
            if (header := read_header(payload)) is not None:
                recent.number(header.source, header.seq)
                recent.stamp_ns = header.stamp_ns
            recent.append(payload, self._bytes)
            return
        recent = self._others.setdefault(key, _Recent(self._kept(key)))
        self._others.move_to_end(key)
        self._other_bytes += recent.append(payload, self._bytes)
        while len(self._others) > 1 and (
            len(self._others) > OTHER_KEYS or self._other_bytes > OTHER_BYTES
        ):
            _, silent = self._others.popitem(last=False)
            self._other_bytes -= silent.size

    def _recent(self, key: str) -> "_Recent":
        return self._keys.get(key) or self._others.get(key) or _NOTHING

    def last(self, key: str) -> bytes:
        """Return the last message of a key; empty if none was heard."""
        with self._lock:
            payloads = self._recent(key).payloads
            return payloads[-1] if payloads else b""

    def since(self, key: str, tick: int) -> SinceReply:
        """Return the latest trial's messages of a key from `tick` on, as many as fit.

        Those without a header are passed over.
        """
        with self._lock:
            recent = self._recent(key)
            payloads, forgot = list(recent.payloads), recent.forgot
        headed = [(header, one) for one in payloads if (header := read_header(one)) is not None]
        trial = headed[-1][0].trial if headed else ""
        asked = [one for header, one in headed if header.trial == trial and header.tick >= tick]
        # What is older than the asked-for was forgotten last.
        older = any(header.trial != trial or header.tick < tick for header, _ in headed)
        fitting = _fitting(asked)
        return SinceReply(
            payloads=asked[:fitting], forgotten=forgot and not older, more=fitting < len(asked)
        )


class _Recent:
    """The last messages of one key.

    Parameters
    ----------
    kept : int
        How many at the most.
    """

    def __init__(self, kept: int) -> None:
        self.payloads: deque[bytes] = deque()
        self.size = 0
        self.forgot = False
        self._kept = kept
        # The last number of each source, and the last stamp.
        self.numbers: dict[str, int] = {}
        self.stamp_ns = 0

    def append(self, payload: bytes, most_bytes: int) -> int:
        """Take a message, forget what is too much, and tell by how many bytes it grew."""
        before = self.size
        self.payloads.append(payload)
        self.size += len(payload)
        while len(self.payloads) > 1 and (
            self.size > most_bytes or len(self.payloads) > self._kept
        ):
            self.size -= len(self.payloads.popleft())
            self.forgot = True
        return self.size - before

    def number(self, source: str, seq: int) -> None:
        """Note the number of a source's message."""
        self.numbers.pop(source, None)
        self.numbers[source] = seq
        if len(self.numbers) > SOURCES:
            del self.numbers[next(iter(self.numbers))]


_NOTHING = _Recent(0)


def _fitting(payloads: list[bytes]) -> int:
    """How many of them go into one reply, at least one."""
    ends = accumulate(len(payload) for payload in payloads)
    return max(1, sum(end <= REPLY_BYTES for end in ends))
