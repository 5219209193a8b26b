"""The bus over Zenoh; the only file that imports it.

QoS, measured on this stack: a blocking congestion policy lets one frozen subscriber stop every
put for seconds; dropping with recovery from the publisher's cache loses nothing and never blocks.
"""

# The wheel's stubs leave handler types open.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

import json
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
    RemoteFault,
)
from fras_common.bus.shared import Answer, Stamper, wait_for
from fras_common.codec import MalformedMessage, decode, encode
from fras_common.errors import FrasError
from fras_common.messages import Fault, Header
from fras_common.topics import Qos, Query, Topic

M = TypeVar("M", bound=Header)
Req = TypeVar("Req")
Rep = TypeVar("Rep")

CACHE = 1000
HEARTBEAT_S = 0.1
ENCODING = zenoh.Encoding("application/msgpack")
TOKENS = ("alive/**", "ready/**")

# Zenoh's own queue of two batches and 1 ms of patience drop samples whenever its sender thread
# waits for a processor, and a sample dropped while an earlier loss is being recovered is never
# recovered (measured: 600 puts of 40 kB on a starved machine lost some in 5 of 10 runs; with these
# settings in none). A link that is congested already drops at once, so nobody waits for long.
TX_QUEUE = {
    "transport/link/tx/queue/size/real_time": 16,
    "transport/link/tx/queue/congestion_control/drop/wait_before_drop": 20_000,
}


class NoRouter(FrasError):
    """No Zenoh router answered at the address given."""


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

    Raises
    ------
    NoRouter
        If none answered in time.
    """

    def __init__(
        self,
        cell: str,
        connect: str,
        source: str,
        on_malformed: OnMalformed = lambda error: None,
        clock_ns: Callable[[], int] = time.time_ns,
        open_timeout_s: float = 10.0,
    ) -> None:
        self._source = source
        self._on_malformed = on_malformed
        self._clock_ns = clock_ns
        self._closed = False
        self._declared: list[Any] = []
        try:
            self._session = zenoh.open(_client_config(cell, connect, open_timeout_s))
        except zenoh.ZError as error:
            raise NoRouter(
                f"no Zenoh router at {connect} within {open_timeout_s} s: start one with "
                f"`fras up`, or name another with --connect ({error})",
                connect=connect,
            ) from error

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
                cache=zenoh.ext.CacheConfig(CACHE),
                sample_miss_detection=zenoh.ext.MissDetectionConfig(
                    heartbeat=HEARTBEAT_S, sporadic_heartbeat=None
                ),
                publisher_detection=True,
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

        def deliver(sample: zenoh.Sample) -> None:
            try:
                message = decode(topic.type, sample.payload.to_bytes(), str(sample.key_expr))
            except MalformedMessage as error:
                self._on_malformed(error)
            else:
                callback(message)

        history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1)
        self._subscribe(
            topic.wildcard,
            deliver,
            history=history if topic.qos is Qos.EVENT else None,
            recover=topic.qos in (Qos.STATE, Qos.EVENT),
        )

    def subscribe_raw(self, key_expr: str, callback: Callable[[RawSample], None]) -> None:
        """Receive samples undecoded, with what the publishers still cache."""

        def deliver(sample: zenoh.Sample) -> None:
            callback(
                RawSample(str(sample.key_expr), sample.payload.to_bytes(), str(sample.encoding))
            )

        history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=CACHE)
        self._subscribe(key_expr, deliver, history=history, recover=True)

    def _subscribe(
        self,
        key_expr: str,
        deliver: Callable[[zenoh.Sample], None],
        history: zenoh.ext.HistoryConfig | None,
        recover: bool,
    ) -> None:
        self.require_open()
        recovery = zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True)
        self._declared.append(
            zenoh.ext.declare_advanced_subscriber(
                self._session,
                key_expr,
                deliver,
                history=history,
                recovery=recovery if recover else None,
            )
        )

    def serve(self, query: Query[Req, Rep], callback: Callable[[Call[Req, Rep]], None]) -> None:
        """Answer a query."""
        self.require_open()

        def receive(asked: zenoh.Query) -> None:
            payload = asked.payload.to_bytes() if asked.payload is not None else b""
            try:
                request = decode(query.request, payload, query.key)
            except MalformedMessage as error:
                self._on_malformed(error)
                _ZenohCall(asked, None).fail(error)
            else:
                callback(_ZenohCall(asked, request))

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

        def on_reply(reply: zenoh.Reply) -> None:
            answer.settle(_outcome(query, reply, timeout_s))

        handler = zenoh.handlers.Callback(on_reply, lambda: answer.expire(query.key, timeout_s))
        self._session.get(
            query.key,
            cast(Any, handler),
            payload=encode(request),
            encoding=ENCODING,
            timeout=timeout_s,
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


class _ZenohCall:
    def __init__(self, asked: zenoh.Query, request: Any) -> None:
        self.request = request
        self._asked = asked

    def reply(self, reply: object) -> None:
        self._asked.reply(self._asked.key_expr, encode(reply), encoding=ENCODING)
        self._asked.drop()

    def fail(self, error: FrasError) -> None:
        fault = Fault(kind=error.kind, text=str(error))
        self._asked.reply_err(encode(fault), encoding=ENCODING)
        self._asked.drop()


def _outcome(query: Query[Any, Rep], reply: zenoh.Reply, timeout_s: float) -> Rep | FrasError:
    try:
        if reply.ok is not None:
            return decode(query.reply, reply.ok.payload.to_bytes(), query.key)
        payload = reply.err.payload.to_bytes() if reply.err is not None else b""
        if payload == b"Timeout":
            # Zenoh itself reports an expired query as an error reply.
            return NoAnswer(query.key, timeout_s)
        return RemoteFault(query.key, decode(Fault, payload, query.key))
    except MalformedMessage as error:
        return error


def _client_config(cell: str, connect: str, open_timeout_s: float) -> zenoh.Config:
    config = zenoh.Config()
    settings = {
        "mode": "client",
        "namespace": f"fras/{cell}",
        "connect/endpoints": [connect],
        "connect/timeout_ms": int(open_timeout_s * 1000),
        "connect/exit_on_failure": True,
        "scouting/multicast/enabled": False,
        "timestamping/enabled": True,
        # Its segments stay behind in /dev/shm; our messages are too small to gain from it.
        "transport/shared_memory/enabled": False,
        **TX_QUEUE,
    }
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config


def route(listen: str, until: Callable[[], None]) -> None:
    """Be a full Zenoh router on `listen` for as long as `until` blocks.

    Raises
    ------
    NoRouter
        If the address can't be bound.
    """
    config = zenoh.Config()
    settings = {
        "mode": "router",
        "listen/endpoints": [listen],
        "scouting/multicast/enabled": False,
        "timestamping/enabled": True,
        # Its segments stay behind in /dev/shm; our messages are too small to gain from it.
        "transport/shared_memory/enabled": False,
        **TX_QUEUE,
    }
    try:
        for key, value in settings.items():
            config.insert_json5(key, json.dumps(value))
        session = zenoh.open(config)
    except zenoh.ZError as error:
        raise NoRouter(f"cannot listen on {listen}: {error}", connect=listen) from error
    try:
        until()
    finally:
        session.close()
