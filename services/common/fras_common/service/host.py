"""The host of a service: everything between the bus and the handlers of one loop.

Callbacks of the bus only append to one bounded inbox; `run` empties it on one thread, so that a
service needs no lock. Whoever serves a query mirrors it on `rpc/...`, so that the log holds it.
"""

import queue
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable
from typing import Any, Generic, TypeVar

import msgspec
import structlog

from fras_common.bus import Bus, Call, Publisher
from fras_common.codec import MalformedMessage, encode
from fras_common.errors import FrasError
from fras_common.messages import Fault, FaultRecord, Header, Health, LogRecord, RpcRecord
from fras_common.messages.service import NIL
from fras_common.service.build import build_of_this_process
from fras_common.service.gate import TrialGate
from fras_common.service.health import ProcessMeter
from fras_common.topics import FAULT, HEALTH, LOG, RPC, Qos, Query, Topic, topic_of

M = TypeVar("M", bound=Header)
Req = TypeVar("Req")
Rep = TypeVar("Rep")

INBOX = 10_000
HEALTH_PERIOD_S = 0.5


class Deferred(Generic[Req, Rep]):
    """A query whose answer comes later; the mirror is published when it does."""

    def __init__(self, host: "ServiceHost", query: Query[Req, Rep], call: Call[Req, Rep]) -> None:
        self._host = host
        self._query = query
        self._call = call
        self._since_s = time.monotonic()

    @property
    def request(self) -> Req:
        """What was asked."""
        return self._call.request

    def reply(self, reply: Rep) -> None:
        """Answer, and mirror the exchange."""
        self._call.reply(reply)
        self._mirror(msgspec.Raw(encode(reply)), None)

    def fail(self, error: FrasError) -> None:
        """Answer with a typed error, and mirror the exchange."""
        self._call.fail(error)
        self._mirror(NIL, Fault(kind=error.kind, text=str(error)))

    def _mirror(self, reply: msgspec.Raw, fault: Fault | None) -> None:
        record = RpcRecord(
            trial=self._host.gate.trial,
            key=self._query.key,
            request=msgspec.Raw(encode(self._call.request)),
            reply=reply,
            fault=fault,
            duration_s=time.monotonic() - self._since_s,
        )
        self._host.post(lambda: self._host.publish_mirror(self._query, record))


class AnotherTrial(FrasError):
    """A message of another trial than the one that is served."""

    counted_as = "another_trial"

    def __init__(self, trial: str, serves: str) -> None:
        super().__init__(
            f"of trial {trial!r}, and {serves!r} is served: dropped", trial=trial, serves=serves
        )


class InternalFault(FrasError):
    """A query met a mistake of our own; the server's log has the traceback."""


class ServiceHost:
    """Connects one service to its bus.

    Parameters
    ----------
    name : str
        `sim`, `sa`, ...
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.gate = TrialGate(self._on_drop)
        self.log: structlog.stdlib.BoundLogger = structlog.get_logger(service=name)
        self.facts: dict[str, str] = {"build": build_of_this_process()}
        self.waiting_for = ""
        self.counts: Counter[str] = Counter()
        self.refusals: Counter[str] = Counter()
        self.tick = -1
        self._bus: Bus | None = None
        self._inbox: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._mirrors: dict[str, Publisher[RpcRecord]] = {}
        self._log_publisher: Publisher[LogRecord] | None = None
        self._faults: Publisher[FaultRecord] | None = None
        self._seqs: dict[str, int] = {}
        self._tokens: dict[str, set[str]] = defaultdict(set)
        self._inputs: set[str] = set()
        self._unmet: set[str] = set()
        self._alive = False
        self._ready = False
        # A plain flag: a signal handler sets it, and an Event's lock is not reentrant.
        self._stopping = False

    # --- set-up ---------------------------------------------------------------------------

    def attach(self, bus: Bus) -> None:
        """Begin to use `bus`; the service declares itself after this."""
        self._bus = bus
        self._log_publisher = bus.publisher(LOG.of(service=self.name))
        bus.watch_tokens(lambda token, present: self.post(lambda: self._on_token(token, present)))

    @property
    def bus(self) -> Bus:
        """The bus, once attached."""
        if self._bus is None:
            raise FrasError("the host has no bus yet: call attach first")
        return self._bus

    def publisher(self, topic: Topic[M]) -> Publisher[M]:
        """Declare a publisher whose puts are counted."""
        return _CountingPublisher(self, self.bus.publisher(topic))

    def subscribe(self, topic: Topic[M], handler: Callable[[M], None]) -> None:
        """Handle each message of `topic` on the loop; in-trial topics pass the trial gate."""
        if topic.producer not in {"*", "client", self.name}:
            self._inputs.add(topic.producer)

        def arrive(message: M) -> None:
            self.post(lambda: self._receive(topic, handler, message))

        self.bus.subscribe(topic, arrive)

    def require(self, *services: str) -> None:
        """Name services whose queries this one asks: it is not ready before they are there."""
        self._inputs.update(services)

    def not_before(self, what: str) -> Callable[[], None]:
        """Name something that has to be done before the service is ready; call the answer then."""
        self._unmet.add(what)

        def done() -> None:
            self._unmet.discard(what)
            self._become_ready()

        return done

    def serve(self, query: Query[Req, Rep], handler: Callable[[Req], Rep]) -> None:
        """Answer each query on the loop with what `handler` returns, or the error it raises."""
        self.serve_deferred(query, lambda pending: self._answer(handler, pending))

    def serve_deferred(
        self, query: Query[Req, Rep], handler: Callable[[Deferred[Req, Rep]], None]
    ) -> None:
        """Hand each query to `handler` on the loop; it answers now or later."""

        def arrive(call: Call[Req, Rep]) -> None:
            pending = Deferred(self, query, call)
            self.post(lambda: handler(pending))

        self.bus.serve(query, arrive)

    def serve_at_once(self, query: Query[Req, Rep], handler: Callable[[Req], Rep]) -> None:
        """Answer on the receiving thread, past the inbox: for holds, which must never wait."""
        self.bus.serve(query, lambda call: self._answer(handler, Deferred(self, query, call)))

    # --- the loop -------------------------------------------------------------------------

    def post(self, job: Callable[[], None]) -> None:
        """Append to the inbox; when it is full the job is dropped and counted."""
        if self._inbox.qsize() >= INBOX:
            self.counts["queue_dropped"] += 1
            return
        self._inbox.put(job)

    @property
    def waiting(self) -> int:
        """Jobs in the inbox."""
        return self._inbox.qsize()

    def enter_trial(self, trial: str) -> None:
        """Begin a trial: what arrived for it too early is handled next, in order."""
        self.tick = -1
        for (topic, handler), message in self.gate.enter(trial):
            self._dispatch(topic, handler, message)

    def run(self, wake: Callable[[], float | None]) -> None:
        """Empty the inbox until `stop`; call `wake` between jobs.

        Parameters
        ----------
        wake : callable
            Does what is due by time, and returns the seconds until it wants to be called again
            (None: only after the next job).
        """
        while not self._stopping:
            wait_s = wake()
            try:
                job = self._inbox.get(timeout=wait_s)
            except queue.Empty:
                continue
            job()

    def drain(self, timeout_s: float) -> bool:
        """Handle one job if it comes within `timeout_s`; for tests that drive the loop by hand."""
        try:
            job = self._inbox.get(timeout=timeout_s)
        except queue.Empty:
            return False
        job()
        return True

    def stop(self) -> None:
        """End `run` after the job under way."""
        self._stopping = True
        self._inbox.put(lambda: None)

    # --- being seen -----------------------------------------------------------------------

    @property
    def state(self) -> str:
        """`starting`, `ready` or `waiting: <who>`."""
        if self.waiting_for:
            return f"waiting: {self.waiting_for}"
        return "ready" if self._ready else "starting"

    def present(self, token: str) -> bool:
        """Whether some instance shows the liveliness token `alive/<name>` or `ready/<name>`."""
        return bool(self._tokens.get(token))

    def announce_alive(self) -> None:
        """Show that all subscriptions and queries stand; `ready` follows when all inputs do."""
        if not self._alive:
            self._alive = True
            self.bus.announce(f"alive/{self.name}")
        self._become_ready()

    def health(self, meter: ProcessMeter) -> Health:
        """Describe this process now."""
        return Health(
            tick=self.tick,
            trial=self.gate.trial,
            service=self.name,
            state=self.state,
            rss_bytes=meter.rss_bytes(),
            cpu_percent=meter.cpu_percent(),
            received=self.counts["received"],
            published=self.counts["published"],
            malformed=self.counts["malformed"],
            refused=self.counts["refused"],
            wrong_trial=self.gate.dropped,
            queue_depth=self.waiting,
            queue_dropped=self.counts["queue_dropped"],
            gaps=self.counts["gaps"],
            facts=dict(self.facts),
            refusals=dict(sorted(self.refusals.items())),
        )

    def report_health(self, stop: threading.Event) -> None:
        """Publish health twice a second until `stop`; runs on a thread of its own."""
        publisher = self.bus.publisher(HEALTH.of(service=self.name))
        meter = ProcessMeter()
        while not stop.wait(HEALTH_PERIOD_S):
            publisher.put(self.health(meter))

    def publish_log(self, record: LogRecord) -> None:
        """Publish a log record; the logging set-up calls it from WARNING up."""
        if self._log_publisher is not None:
            self._log_publisher.put(msgspec.structs.replace(record, trial=self.gate.trial))

    def publish_mirror(self, query: Query[Any, Any], record: RpcRecord) -> None:
        """Publish the mirror of a query."""
        if query.mirror not in self._mirrors:
            _, server, name = query.mirror.split("/", 2)
            self._mirrors[query.mirror] = self.publisher(RPC.of(service=server, name=name))
        self._mirrors[query.mirror].put(record)

    def report_fault(self, key: str, error: FrasError, *, trial: str = "", tick: int = -1) -> None:
        """Publish what was refused, with the numbers behind it, and count it by name.

        Parameters
        ----------
        key : str
            Where what was refused came in.
        error : FrasError
            Why.
        trial, tick
            Of what was refused.
        """
        self.refusals[error.counted_as or error.kind] += 1
        if self._faults is None:
            self._faults = self.publisher(FAULT.of(service=self.name))
        self._faults.put(
            FaultRecord(
                trial=trial,
                tick=tick,
                key=key,
                kind=error.kind,
                text=str(error),
                values={name: str(value) for name, value in error.values.items()},
            )
        )

    def count_malformed(self, error: MalformedMessage) -> None:
        """Count and log a payload that did not fit its key; the bus calls it."""
        self.counts["malformed"] += 1
        self.post(lambda: self._tell_malformed(error))

    # --- inside ---------------------------------------------------------------------------

    def _tell_malformed(self, error: MalformedMessage) -> None:
        self.log.warning("malformed message dropped", problem=str(error))
        key = str(error.values["key"])
        topic = topic_of(key)
        if topic is not None and topic.qos is Qos.COMMAND:
            # Whoever leads an arm learns why it does not follow, whatever was wrong.
            self.report_fault(key, error)

    def _answer(self, handler: Callable[[Any], Any], pending: Deferred[Any, Any]) -> None:
        try:
            reply = handler(pending.request)
        except FrasError as error:
            pending.fail(error)
        except Exception as error:
            self.log.exception("a query failed unexpectedly")
            pending.fail(InternalFault(f"{type(error).__name__}: {error}"))
        else:
            pending.reply(reply)

    def _receive(self, topic: Topic[M], handler: Callable[[M], None], message: M) -> None:
        # A family's callback does not learn the key, so its streams can't be told apart.
        if "{" not in topic.key:
            self._count_gap(f"{topic.key}:{message.source}", message.seq)
        self._dispatch(topic, handler, message)

    def _count_gap(self, stream: str, seq: int) -> None:
        """Count what is missing; before the gate, for what it drops has arrived all the same."""
        last = self._seqs.get(stream, seq)
        self.counts["gaps"] += max(0, seq - last - 1)
        self._seqs[stream] = max(last, seq)

    def _dispatch(self, topic: Topic[M], handler: Callable[[M], None], message: M) -> None:
        if topic.in_trial and not self.gate.admit((topic, handler), message):
            return
        self.counts["received"] += 1
        try:
            handler(message)
        except FrasError as error:
            # Refused for what it says; anything else is our own mistake and ends the process.
            self.counts["refused"] += 1
            self.log.error("message refused", key=topic.key, problem=str(error))
            self.report_fault(topic.key, error, trial=message.trial, tick=message.tick)

    def _on_drop(self, route: tuple[Topic[Any], Any], message: Header, serves: str) -> None:
        error = AnotherTrial(message.trial, serves)
        self.report_fault(route[0].key, error, trial=message.trial, tick=message.tick)

    def _on_token(self, token: str, present: bool) -> None:
        name, _, instance = token.rpartition("/")
        if present:
            self._tokens[name].add(instance)
        else:
            self._tokens[name].discard(instance)
        self._become_ready()

    def _become_ready(self) -> None:
        if self._ready or self._unmet or not self.present(f"alive/{self.name}"):
            return
        if all(self.present(f"alive/{producer}") for producer in self._inputs):
            self._ready = True
            self.bus.announce(f"ready/{self.name}")
            self.log.info("ready")


class _CountingPublisher(Generic[M]):
    def __init__(self, host: ServiceHost, inner: Publisher[M]) -> None:
        self._host = host
        self._inner = inner

    def put(self, message: M) -> M:
        self._host.counts["published"] += 1
        return self._inner.put(message)
