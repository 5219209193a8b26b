"""The bus over Zenoh.

QoS, measured on this stack: a blocking congestion policy lets one frozen subscriber stop every
put for seconds; dropping with recovery from the publisher's cache loses nothing and never blocks.
A reply has the policy and the priority of its question, and a publisher's cache holds back its puts
while it replies: who asks a cache lets it drop, and asks again.
"""

# The wheel's stubs leave handler types open.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

import threading
import time
from collections.abc import Callable
from typing import Any, Generic, TypeVar, cast

import zenoh
import zenoh.ext

from fras_common.bus.contract import (
    BusClosed,
    Call,
    NoAnswer,
    OnMalformed,
    RawSample,
)
from fras_common.bus.hearing import Asker, Hearing
from fras_common.bus.past import CACHES, Beat, Cached, Past
from fras_common.bus.recovery import ALL_OF_WHO_BEGINS, Earlier
from fras_common.bus.settings import NoRouter, client_settings
from fras_common.bus.shared import Answer, Kept, Stamper, decoding, wait_for
from fras_common.bus.zenoh_ring import Ring
from fras_common.bus.zenoh_wire import ENCODING, ZenohCall, beat, configured, numbered, outcome, raw
from fras_common.codec import MalformedMessage, decode, encode
from fras_common.errors import FrasError
from fras_common.identity import Identity, require_tls
from fras_common.keeping import beat_s_of, kept_of
from fras_common.messages import Header
from fras_common.topics import Qos, Query, Topic

T = TypeVar("T")
M = TypeVar("M", bound=Header)
Req = TypeVar("Req")
Rep = TypeVar("Rep")

# Numbers that may wait until they are looked at; whoever repeats one does so again.
BEATS = 1024
TOKENS = ("alive/**", "ready/**")
# What a subscriber that begins later, or hears of a publisher later, gets of what was said before.
EARLIER = {Qos.STATE: Earlier(0, 0), Qos.EVENT: Earlier(1, 1)}


class ZenohBus:
    """One participant's session.

    Parameters
    ----------
    cell : str
        The session's Zenoh namespace is `fras/<cell>`.
    connect : str
        Router's endpoint, `tcp/127.0.0.1:7447`.
    source : str
        Service and instance that the messages will bear.
    on_malformed : callable, optional
        Gets each payload that did not fit its key.
    clock_ns : callable
        Wall clock for the stamps.
    open_timeout_s : float
        How long to wait for the router.
    identity : Identity, optional
        What it shows to a router at a `tls/` endpoint.

    Raises
    ------
    NoRouter
        If none answered in time, or the router does not know the identity.
    BadIdentity
        If the endpoint is `tls/` without an identity, or another one with it.
    """

    def __init__(
        self,
        cell: str,
        connect: str,
        source: str,
        on_malformed: OnMalformed = lambda error: None,
        clock_ns: Callable[[], int] = time.time_ns,
        open_timeout_s: float = 10.0,
        identity: Identity | None = None,
    ) -> None:
        require_tls(connect, identity)
        self._source = source
        self._on_malformed = on_malformed
        self._clock_ns = clock_ns
        self._closed = False
        self._declared: list[Any] = []
        self._asker = Asker()
        try:
            settings = client_settings(cell, connect, open_timeout_s, identity)
            self._session = zenoh.open(configured(settings))
        except zenoh.ZError as error:
            raise NoRouter.within(open_timeout_s, connect, identity, error) from error

    def publisher(self, topic: Topic[M]) -> "_ZenohPublisher[M]":
        """Declare a publisher on a concrete key."""
        declared = self._declare_publisher(topic.key, topic.qos)
        return _ZenohPublisher(self, declared, Stamper(self._source, self._clock_ns))

    def publisher_raw(self, key: str, qos: Qos) -> "_ZenohRawPublisher":
        """Declare a publisher of bytes on any key."""
        return _ZenohRawPublisher(self, self._declare_publisher(key, qos))

    def _declare_publisher(self, key: str, qos: Qos) -> Any:
        self.require_open()
        if qos is Qos.TELEMETRY:
            declared: Any = self._session.declare_publisher(
                key,
                encoding=ENCODING,
                congestion_control=zenoh.CongestionControl.DROP,
                reliability=zenoh.Reliability.BEST_EFFORT,
            )
        elif qos is Qos.COMMAND:
            declared = self._session.declare_publisher(
                key,
                encoding=ENCODING,
                congestion_control=zenoh.CongestionControl.DROP,
                reliability=zenoh.Reliability.RELIABLE,
                priority=zenoh.Priority.REAL_TIME,
                express=True,
            )
        else:
            declared = zenoh.ext.declare_advanced_publisher(
                self._session,
                key,
                encoding=ENCODING,
                congestion_control=zenoh.CongestionControl.DROP,
                reliability=zenoh.Reliability.RELIABLE,
                priority=zenoh.Priority.REAL_TIME,
                express=True,
                cache=zenoh.ext.CacheConfig(kept_of(key)),
                sample_miss_detection=zenoh.ext.MissDetectionConfig(
                    heartbeat=beat_s_of(key), sporadic_heartbeat=None
                ),
            )
        self._declared.append(declared)
        return declared

    def undeclare(self, declared: Any) -> None:
        """Undeclare one thing before the rest; idempotent."""
        if declared in self._declared:
            self._declared.remove(declared)
            declared.undeclare()

    def subscribe(self, topic: Topic[M], callback: Callable[[M], None]) -> None:
        """Receive every message of a key or family."""
        deliver = decoding(topic, callback, self._on_malformed)
        if (earlier := EARLIER.get(topic.qos)) is not None:
            self._hear(topic.wildcard, deliver, earlier)
            return
        self.require_open()
        self._declared.append(
            self._session.declare_subscriber(topic.wildcard, lambda sample: deliver(raw(sample)))
        )

    def recent(self, topic: Topic[M], at_most: int) -> Kept[M]:
        """Look now and then at what came on a concrete key."""
        self.require_open()
        return Kept(topic, self._ring(topic.key, at_most, raw), self._on_malformed)

    def _ring(self, key_expr: str, at_most: int, read: Callable[[zenoh.Sample], T]) -> Ring[T]:
        ring = Ring(self._session, key_expr, at_most, read)
        self._declared.append(ring)
        return ring

    def subscribe_raw(self, key_expr: str, callback: Callable[[RawSample], None]) -> None:
        """Receive samples undecoded, from now on."""
        self._hear(key_expr, callback, ALL_OF_WHO_BEGINS)

    def _hear(self, key_expr: str, callback: Callable[[RawSample], None], earlier: Earlier) -> None:
        self.require_open()
        beats = self._ring(f"{key_expr}{CACHES}**", BEATS, beat)

        def take_beats() -> list[Beat]:
            return [one for one in beats.take() if one is not None]

        hearing = Hearing(self._asker, self._get_cached, take_beats, callback, earlier)

        def note(sample: zenoh.Sample) -> None:
            if (heard := numbered(sample)) is not None:
                hearing.note(heard)
            else:
                hearing.pass_on(raw(sample))

        self._declared.append(self._session.declare_subscriber(key_expr, note))
        hearing.ask_latest(key_expr)

    def cached(
        self, key_expr: str, on_done: Callable[[list[RawSample]], None], timeout_s: float
    ) -> None:
        """Ask without waiting for all that publishers still cache; each one's come in order."""
        self.require_open()
        Past(self._get_cached, on_done, timeout_s).ask(key_expr)

    def _get_cached(
        self,
        selector: str,
        note: Callable[[Cached], None],
        on_end: Callable[[], None],
        timeout_s: float,
    ) -> None:
        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None and (found := numbered(reply.ok)) is not None:
                note(found)

        try:
            self._session.get(
                selector,
                cast(Any, zenoh.handlers.Callback(on_reply, on_end)),
                target=zenoh.QueryTarget.ALL,
                consolidation=zenoh.ConsolidationMode.NONE,
                accept_replies=zenoh.ReplyKeyExpr.ANY,
                # What was said before gives way to what is said now, health above all.
                congestion_control=zenoh.CongestionControl.DROP,
                priority=zenoh.Priority.DATA_LOW,
                timeout=timeout_s,
            )
        except zenoh.ZError:
            # Closed meanwhile: what came until then is the answer.
            if not self._closed:
                raise
            on_end()

    def serve(self, query: Query[Req, Rep], callback: Callable[[Call[Req, Rep]], None]) -> None:
        """Answer a query."""
        self.require_open()

        def receive(asked: zenoh.Query) -> None:
            payload = asked.payload.to_bytes() if asked.payload is not None else b""
            try:
                request = decode(query.request, payload, query.key, query.max_bytes)
            except MalformedMessage as error:
                self._on_malformed(error)
                ZenohCall(asked, None).fail(error)
            else:
                callback(ZenohCall(asked, request))

        self._declared.append(self._session.declare_queryable(query.key, receive, complete=True))

    def ask(
        self,
        query: Query[Req, Rep],
        request: Req,
        on_done: Callable[[Rep | FrasError], None],
        timeout_s: float,
    ) -> None:
        """Ask without waiting."""
        self.require_open()
        answer: Answer[Rep] = Answer(on_done)
        refusals: list[FrasError] = []

        def on_reply(reply: zenoh.Reply) -> None:
            came = outcome(query, reply, timeout_s)
            if isinstance(came, FrasError):
                refusals.append(came)
            else:
                answer.settle(came)

        def on_end() -> None:
            # Where each host has a supervisor all are asked, and one does it.
            answer.settle(refusals[0] if refusals else NoAnswer(query.key, timeout_s))

        handler = zenoh.handlers.Callback(on_reply, on_end)
        self._session.get(
            query.key,
            cast(Any, handler),
            payload=encode(request),
            encoding=ENCODING,
            timeout=timeout_s,
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            congestion_control=zenoh.CongestionControl.BLOCK,
            express=True,
        )

    def query(self, query: Query[Req, Rep], request: Req, timeout_s: float) -> Rep:
        """Ask and wait."""
        return wait_for(lambda done: self.ask(query, request, done, timeout_s), query, timeout_s)

    def announce(self, token: str) -> None:
        """Declare a liveliness token."""
        self.require_open()
        full = f"{token}/{self._source.partition('/')[2]}"
        self._declared.append(self._session.liveliness().declare_token(full))

    def watch_tokens(self, callback: Callable[[str, bool], None]) -> None:
        """Report each token that appears (True) or goes (False), those present first."""
        self.require_open()

        def deliver(sample: zenoh.Sample) -> None:
            callback(str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT)

        for key_expr in TOKENS:
            self._declared.append(
                self._session.liveliness().declare_subscriber(key_expr, deliver, history=True)
            )

    def tokens(self, timeout_s: float) -> frozenset[str]:
        """Ask who is there now and wait for the whole answer."""
        self.require_open()
        found: set[str] = set()
        for key_expr in TOKENS:
            # The router itself ends the answer; a timeout comes as an error.
            for reply in self._session.liveliness().get(key_expr, timeout=timeout_s):
                if reply.ok is None:
                    raise NoAnswer(key_expr, timeout_s)
                found.add(str(reply.ok.key_expr))
        if not self._session.info.routers_zid():
            # Without one the answer is empty, and comes at once.
            raise NoAnswer(TOKENS[0], timeout_s)
        return frozenset(found)

    def close(self) -> None:
        """Undeclare everything and close; a session left open would hang the process at exit."""
        if self._closed:
            return
        self._closed = True
        self._asker.close()
        for declared in reversed(self._declared):
            declared.undeclare()
        self._declared.clear()
        self._session.close()

    def require_open(self) -> None:
        """Raise `BusClosed` once the bus is closed."""
        if self._closed:
            raise BusClosed("this bus is closed: open a new one")


class _ZenohPublisher(Generic[M]):
    def __init__(self, bus: ZenohBus, declared: Any, stamper: Stamper) -> None:
        self._bus = bus
        self._declared = declared
        self._stamper = stamper
        # Reentrant: a put may run a local callback that logs, and so puts again.
        self._in_order = threading.RLock()

    def put(self, message: M) -> M:
        self._bus.require_open()
        with self._in_order:
            stamped = self._stamper.stamp(message)
            self._declared.put(encode(stamped))
        return stamped


class _ZenohRawPublisher:
    def __init__(self, bus: ZenohBus, declared: Any) -> None:
        self._bus = bus
        self._declared = declared

    def put(self, payload: bytes, encoding: str) -> None:
        self._bus.require_open()
        self._declared.put(payload, encoding=zenoh.Encoding(encoding))

    def close(self) -> None:
        self._bus.undeclare(self._declared)
