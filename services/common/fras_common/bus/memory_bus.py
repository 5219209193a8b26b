"""The bus without a network: for unit tests, and for whole services in one process.

It keeps the same contract as the Zenoh bus, bytes included: every message is encoded and decoded,
so that what works here is what travels there.
"""

import threading
import time
from collections import defaultdict, deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from fras_common.bus.contract import BusClosed, Call, OnMalformed, RawSample, RemoteFault
from fras_common.bus.shared import Answer, Kept, Stamper, decoding, wait_for
from fras_common.codec import MalformedMessage, decode, encode
from fras_common.errors import FrasError
from fras_common.keeping import kept_of
from fras_common.messages import Fault, Header
from fras_common.topics import Qos, Query, Topic

M = TypeVar("M", bound=Header)
Req = TypeVar("Req")
Rep = TypeVar("Rep")


@dataclass(frozen=True)
class _Subscription:
    owner: "MemoryBus"
    key_expr: str
    deliver: Callable[[RawSample], None]


class MemoryFabric:
    """What the participants of one process share: the stand-in for router and wire."""

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.subscriptions: dict[str, list[_Subscription]] = defaultdict(list)
        self.servers: dict[tuple[str, str], tuple[MemoryBus, Callable[[bytes, _Return], None]]] = {}
        self.caches: dict[str, dict[tuple[int, str], deque[RawSample]]] = defaultdict(dict)
        self.tokens: dict[str, dict[tuple[int, str], str]] = defaultdict(dict)
        self.watchers: dict[str, list[tuple[MemoryBus, Callable[[str, bool], None]]]] = defaultdict(
            list
        )


_Return = Callable[[bytes | Fault], None]


def matches(key_expr: str, key: str) -> bool:
    """Whether `key` is matched by `key_expr`, of which only a trailing `**` is special."""
    if key_expr.endswith("**"):
        return key.startswith(key_expr[:-2])
    return key == key_expr


class MemoryBus:
    """One participant on a `MemoryFabric`.

    Parameters
    ----------
    fabric : MemoryFabric
    cell : str
        Participants of different cells don't hear each other.
    source : str
        Service and instance that the messages will bear.
    on_malformed : callable, optional
        Gets each payload that did not fit its key.
    clock_ns : callable
        Wall clock for the stamps.
    """

    def __init__(
        self,
        fabric: MemoryFabric,
        cell: str,
        source: str,
        on_malformed: OnMalformed = lambda error: None,
        clock_ns: Callable[[], int] = time.time_ns,
    ) -> None:
        self._fabric = fabric
        self._cell = cell
        self._source = source
        self._on_malformed = on_malformed
        self._clock_ns = clock_ns
        self._closed = False
        self._asked: dict[Answer[Any], tuple[threading.Timer, str, float]] = {}

    def publisher(self, topic: Topic[M]) -> "_MemoryPublisher[M]":
        """Declare a publisher on a concrete key."""
        self._require_open()
        return _MemoryPublisher(self, topic, Stamper(self._source, self._clock_ns))

    def publisher_raw(self, key: str, qos: Qos) -> "_MemoryRawPublisher":
        """Declare a publisher of bytes on any key."""
        self._require_open()
        return _MemoryRawPublisher(self, key, qos)

    def subscribe(self, topic: Topic[M], callback: Callable[[M], None]) -> None:
        """Receive every message of a key or family."""
        deliver = decoding(topic, callback, self._on_malformed)
        self._subscribe(topic.wildcard, deliver, history=1 if topic.qos is Qos.EVENT else 0)

    def recent(self, topic: Topic[M], at_most: int) -> Kept[M]:
        """Look now and then at what came on a concrete key."""
        ring = _Ring(at_most)
        self._subscribe(topic.key, ring.note, history=0)
        return Kept(topic, ring, self._on_malformed)

    def subscribe_raw(self, key_expr: str, callback: Callable[[RawSample], None]) -> None:
        """Receive samples undecoded, from now on."""
        self._subscribe(key_expr, callback, history=0)

    def _subscribe(self, key_expr: str, deliver: Callable[[RawSample], None], history: int) -> None:
        self._require_open()
        with self._fabric.lock:
            self._fabric.subscriptions[self._cell].append(_Subscription(self, key_expr, deliver))
            if history:
                for (_, key), cache in self._fabric.caches[self._cell].items():
                    if matches(key_expr, key):
                        for sample in list(cache)[-history:]:
                            deliver(sample)

    def cached(
        self, key_expr: str, on_done: Callable[[list[RawSample]], None], timeout_s: float
    ) -> None:
        """Ask without waiting for all that publishers still cache; each one's come in order."""
        del timeout_s
        self._require_open()
        with self._fabric.lock:
            caches = self._fabric.caches[self._cell].items()
            samples = [one for (_, key), cache in caches if matches(key_expr, key) for one in cache]
        on_done(samples)

    def serve(self, query: Query[Req, Rep], callback: Callable[[Call[Req, Rep]], None]) -> None:
        """Answer a query."""
        self._require_open()

        def receive(payload: bytes, give_back: _Return) -> None:
            try:
                request = decode(query.request, payload, query.key, query.max_bytes)
            except MalformedMessage as error:
                self._on_malformed(error)
                give_back(Fault(kind=error.kind, text=str(error)))
            else:
                callback(_MemoryCall(request, give_back))

        with self._fabric.lock:
            self._fabric.servers[self._cell, query.key] = (self, receive)

    def ask(
        self,
        query: Query[Req, Rep],
        request: Req,
        on_done: Callable[[Rep | FrasError], None],
        timeout_s: float,
    ) -> None:
        """Ask without waiting."""
        self._require_open()
        answer: Answer[Rep] = Answer(on_done)
        with self._fabric.lock:
            server = self._fabric.servers.get((self._cell, query.key))
        if server is None:
            answer.expire(query.key, timeout_s)
            return
        payload = encode(request)

        def expire() -> None:
            self._asked.pop(answer, None)
            answer.expire(query.key, timeout_s)

        timer = threading.Timer(timeout_s, expire)
        timer.daemon = True
        self._asked[answer] = (timer, query.key, timeout_s)

        def give_back(outcome: bytes | Fault) -> None:
            timer.cancel()
            self._asked.pop(answer, None)
            if isinstance(outcome, Fault):
                answer.settle(RemoteFault(query.key, outcome))
                return
            try:
                answer.settle(decode(query.reply, outcome, query.key))
            except MalformedMessage as error:
                answer.settle(error)

        timer.start()
        server[1](payload, give_back)

    def query(self, query: Query[Req, Rep], request: Req, timeout_s: float) -> Rep:
        """Ask and wait."""
        return wait_for(lambda done: self.ask(query, request, done, timeout_s), query, timeout_s)

    def announce(self, token: str) -> None:
        """Declare a liveliness token."""
        self._require_open()
        full = f"{token}/{self._source.partition('/')[2]}"
        with self._fabric.lock:
            self._fabric.tokens[self._cell][id(self), token] = full
            for _, watcher in self._fabric.watchers[self._cell]:
                watcher(full, True)

    def watch_tokens(self, callback: Callable[[str, bool], None]) -> None:
        """Report each token that appears (True) or goes (False), those present first."""
        self._require_open()
        with self._fabric.lock:
            self._fabric.watchers[self._cell].append((self, callback))
            for full in self._fabric.tokens[self._cell].values():
                callback(full, True)

    def tokens(self, timeout_s: float) -> frozenset[str]:
        """Ask who is there now."""
        del timeout_s
        self._require_open()
        with self._fabric.lock:
            return frozenset(self._fabric.tokens[self._cell].values())

    def close(self) -> None:
        """Leave the fabric; idempotent."""
        if self._closed:
            return
        self._closed = True
        fabric, cell = self._fabric, self._cell
        with fabric.lock:
            fabric.subscriptions[cell] = [
                entry for entry in fabric.subscriptions[cell] if entry.owner is not self
            ]
            fabric.watchers[cell] = [
                entry for entry in fabric.watchers[cell] if entry[0] is not self
            ]
            for address in [key for key, entry in fabric.servers.items() if entry[0] is self]:
                del fabric.servers[address]
            for slot in [slot for slot in fabric.caches[cell] if slot[0] == id(self)]:
                del fabric.caches[cell][slot]
            for slot in [slot for slot in fabric.tokens[cell] if slot[0] == id(self)]:
                gone = fabric.tokens[cell].pop(slot)
                for _, watcher in fabric.watchers[cell]:
                    watcher(gone, False)
        for answer, (timer, key, timeout_s) in list(self._asked.items()):
            timer.cancel()
            answer.expire(key, timeout_s)

    def in_order(self) -> threading.RLock:
        """Lock under which stamping and delivery are one step."""
        return self._fabric.lock

    def carry(self, topic: Topic[Any], sample: RawSample) -> None:
        """Deliver a sample to whoever subscribed, and cache it as its QoS class says."""
        self.carry_as(topic.qos, sample)

    def forget(self, key: str) -> None:
        """Drop what is kept of a key for whoever comes later."""
        with self._fabric.lock:
            self._fabric.caches[self._cell].pop((id(self), key), None)

    def carry_as(self, qos: Qos, sample: RawSample) -> None:
        """Deliver a sample in a QoS class."""
        self._require_open()
        with self._fabric.lock:
            if qos in (Qos.STATE, Qos.EVENT):
                slot = (id(self), sample.key)
                caches = self._fabric.caches[self._cell]
                caches.setdefault(slot, deque(maxlen=kept_of(sample.key))).append(sample)
            for subscription in list(self._fabric.subscriptions[self._cell]):
                if matches(subscription.key_expr, sample.key):
                    subscription.deliver(sample)

    def _require_open(self) -> None:
        if self._closed:
            raise BusClosed("this bus is closed: open a new one")


class _Ring:
    def __init__(self, at_most: int) -> None:
        self._kept = deque[RawSample](maxlen=at_most)
        self._hears = True
        self._lock = threading.Lock()

    def note(self, sample: RawSample) -> None:
        with self._lock:
            if self._hears:
                self._kept.append(sample)

    def take(self) -> list[RawSample]:
        with self._lock:
            taken = list(self._kept)
            self._kept.clear()
        return taken

    def pause(self) -> None:
        with self._lock:
            self._hears = False
            self._kept.clear()

    def resume(self) -> None:
        with self._lock:
            self._hears = True


class _MemoryPublisher(Generic[M]):
    def __init__(self, bus: MemoryBus, topic: Topic[M], stamper: Stamper) -> None:
        self._bus = bus
        self._topic = topic
        self._stamper = stamper

    def put(self, message: M) -> M:
        with self._bus.in_order():
            stamped = self._stamper.stamp(message)
            sample = RawSample(self._topic.key, encode(stamped), "application/msgpack")
            self._bus.carry(self._topic, sample)
        return stamped


class _MemoryRawPublisher:
    def __init__(self, bus: MemoryBus, key: str, qos: Qos) -> None:
        self._bus = bus
        self._key = key
        self._qos = qos

    def put(self, payload: bytes, encoding: str) -> None:
        self._bus.carry_as(self._qos, RawSample(self._key, payload, encoding))

    def close(self) -> None:
        self._bus.forget(self._key)


class _MemoryCall:
    def __init__(self, request: Any, give_back: _Return) -> None:
        self.request = request
        self._give_back = give_back

    def reply(self, reply: object) -> None:
        self._give_back(encode(reply))

    def fail(self, error: FrasError) -> None:
        self._give_back(Fault(kind=error.kind, text=str(error)))
