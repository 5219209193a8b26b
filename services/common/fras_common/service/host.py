"""The host of a service: everything between the bus and the handlers of one loop.

Callbacks of the bus only append to one inbox; `run` empties it on one thread, so that a service
needs no lock. What others send is bounded, each key and each query by itself; what the service has
asked for itself, an answer for example, is never dropped. Whoever serves a query mirrors it on
`rpc/...`, so that the log holds it.
"""

import queue
import threading
import time
from collections import Counter
from collections.abc import Callable
from typing import Any, TypeVar

import msgspec
import structlog

from fras_common.bus import Bus, Call, Publisher
from fras_common.codec import MalformedMessage
from fras_common.errors import FrasError
from fras_common.messages import FaultRecord, Header, Health, LogRecord, RpcRecord
from fras_common.provenance import WrongSource
from fras_common.service.build import build_of_this_process
from fras_common.service.errors import AnotherTrial, InternalFault, Sources, record_of
from fras_common.service.freshness import Freshness, StaleCommand
from fras_common.service.gaps import Gaps
from fras_common.service.gate import TrialGate
from fras_common.service.health import ProcessMeter
from fras_common.service.presence import Presence
from fras_common.service.publishing import CountingPublisher
from fras_common.service.pulse import Pulse
from fras_common.service.queries import Deferred
from fras_common.service.rates import Admission, Budget, Room, Telling, TooManyQueries, and_more
from fras_common.topics import FAULT, HEALTH, LOG, RPC, Qos, Query, Topic, topic_of

M = TypeVar("M", bound=Header)
Req = TypeVar("Req")
Rep = TypeVar("Rep")

INBOX = 10_000
"""Messages of one subscription that may wait."""
HEALTH_PERIOD_S = 0.5


class ServiceHost:
    """Connects one service to its bus.

    Parameters
    ----------
    name : str
        `sim`, `sa`, ...
    clock_ns : callable
        Wall clock, against which the stamps of commands are held.
    """

    def __init__(self, name: str, clock_ns: Callable[[], int] = time.time_ns) -> None:
        self.name = name
        self.gate = TrialGate(self._on_drop)
        self.log: structlog.stdlib.BoundLogger = structlog.get_logger(service=name)
        self.facts: dict[str, str] = {"build": build_of_this_process()}
        self.waiting_for = ""
        self.clock: Callable[[], float] = time.monotonic
        self.waits_elsewhere: Callable[[], int] = lambda: 0
        self.counts: Counter[str] = Counter()
        self.refusals: Counter[str] = Counter()
        self._counting = threading.Lock()
        self._telling = Telling()
        self.tick = -1
        self._clock_ns = clock_ns
        self._freshness = Freshness()
        self._told_of = Sources()
        self._bus: Bus | None = None
        self._inbox: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._pulse = Pulse(self._inbox.put)
        self._mirrors: dict[str, Publisher[RpcRecord]] = {}
        self._log_publisher: Publisher[LogRecord] | None = None
        self._faults: Publisher[FaultRecord] | None = None
        self._gaps = Gaps()
        self._presence = Presence(name)
        self.loop_thread = 0
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
        return CountingPublisher(self.counts, self.bus.publisher(topic))

    def subscribe(
        self, topic: Topic[M], handler: Callable[[M], None], *, required: bool = True
    ) -> None:
        """Handle each message of `topic` on the loop; in-trial topics pass the trial gate.

        Ready is the service only once a required producer is there.
        """
        if required and topic.producer not in {"*", "client", self.name}:
            self._presence.inputs.add(topic.producer)
        room = Room(INBOX)

        def handle(message: M) -> None:
            room.leave()
            self._receive(topic, handler, message)

        def arrive(message: M) -> None:
            if room.enter():
                self.post(lambda: handle(message))
            else:
                self._count("queue_dropped")

        self.bus.subscribe(topic, arrive)

    def require(self, *services: str) -> None:
        """Name services whose queries this one asks: it is not ready before they are there."""
        self._presence.inputs.update(services)

    def not_before(self, what: str) -> Callable[[], None]:
        """Name something that has to be done before the service is ready; call the answer then."""
        self._presence.unmet.add(what)

        def done() -> None:
            self._presence.unmet.discard(what)
            self._become_ready()

        return done

    def serve(self, query: Query[Req, Rep], handler: Callable[[Req], Rep]) -> None:
        """Answer each query on the loop with what `handler` returns, or the error it raises."""
        self.serve_deferred(query, lambda pending: self._answer(handler, pending))

    def serve_deferred(
        self, query: Query[Req, Rep], handler: Callable[[Deferred[Req, Rep]], None]
    ) -> None:
        """Hand each query to `handler` on the loop; it answers now or later."""
        admission = Admission()

        def handle(pending: Deferred[Req, Rep]) -> None:
            admission.leave()
            self._guarded(pending, lambda: handler(pending))

        def arrive(call: Call[Req, Rep]) -> None:
            pending = Deferred(self, query, call)
            if admission.enter(self.clock()):
                self.post(lambda: handle(pending))
            else:
                self._refuse(call, TooManyQueries(query.key))

        self.bus.serve(query, arrive)

    def serve_at_once(self, query: Query[Req, Rep], handler: Callable[[Req], Rep]) -> None:
        """Answer on the receiving thread, past the inbox: for holds, which must never wait.

        None is refused for coming too often; it is counted then, and not mirrored.
        """
        budget = Budget()

        def arrive(call: Call[Req, Rep]) -> None:
            pending = Deferred(self, query, call)
            pending.mirrored = budget.take(self.clock())
            if not pending.mirrored:
                self.count_refusal("not_mirrored")
                text = "asked so often that not all is mirrored"
                self.tell(f"query {query.key}", "warning", text, key=query.key)
            self._answer(handler, pending)

        self.bus.serve(query, arrive)

    # --- the loop -------------------------------------------------------------------------

    def post(self, job: Callable[[], None]) -> None:
        """Append to the inbox; for what cannot come without end."""
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
        self.loop_thread = threading.get_ident()
        while not self._stopping:
            self.drain(wake())

    def drain(self, timeout_s: float | None) -> bool:
        """Handle one job if it comes within `timeout_s` (None: whenever it comes)."""
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
        return "ready" if self._presence.is_ready else "starting"

    def present(self, token: str) -> bool:
        """Whether some instance shows the liveliness token `alive/<name>` or `ready/<name>`."""
        return self._presence.of(token)

    def announce_alive(self) -> None:
        """Show that all subscriptions and queries stand; `ready` follows when all inputs do."""
        if not self._presence.is_alive:
            self._presence.is_alive = True
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
            queue_depth=self.waiting + self.waits_elsewhere(),
            queue_dropped=self.counts["queue_dropped"],
            gaps=self.counts["gaps"],
            facts=dict(self.facts),
            refusals=dict(sorted(self.refusals.items())),
            loop_lag_s=self._pulse.lag_s(time.monotonic()),
        )

    def report_health(self, stop: threading.Event) -> None:
        """Publish health twice a second until `stop`; runs on a thread of its own."""
        publisher = self.bus.publisher(HEALTH.of(service=self.name))
        meter = ProcessMeter()
        while not stop.wait(HEALTH_PERIOD_S):
            publisher.put(self.health(meter))
            self._pulse.beat(time.monotonic())

    def publish_log(self, record: LogRecord) -> None:
        """Publish a log record; the logging set-up calls it from WARNING up."""
        if self._log_publisher is not None:
            self._log_publisher.put(msgspec.structs.replace(record, trial=self.gate.trial))

    def tell(self, about: str, level: str, event: str, **fields: object) -> None:
        """Log what others can cause without end: of each subject some at once, then one a second.

        Parameters
        ----------
        about : str
            The subject, with the source if each is told of by itself.
        level : str
            `info`, `warning` or `error`.
        event, fields
            As of the log; where some were not told before, the event says how many.
        """
        if (untold := self._telling.due(about, self.clock())) is not None:
            self.post(lambda: getattr(self.log, level)(f"{event}{and_more(untold)}", **fields))

    def publish_mirror(self, query: Query[Any, Any], record: RpcRecord) -> None:
        """Publish the mirror of a query."""
        if query.mirror not in self._mirrors:
            _, server, name = query.mirror.split("/", 2)
            self._mirrors[query.mirror] = self.publisher(RPC.of(service=server, name=name))
        self._mirrors[query.mirror].put(record)

    def report_fault(self, key: str, error: FrasError, *, trial: str = "", tick: int = -1) -> None:
        """Publish what was refused (see `record_of`), and count it by name."""
        self.count_refusal(error.counted_as or error.kind)
        if self._faults is None:
            self._faults = self.publisher(FAULT.of(service=self.name))
        self._faults.put(record_of(key, error, trial, tick))

    def count_malformed(self, error: MalformedMessage) -> None:
        """Count and log a payload that did not fit its key, or is not of whom the table says."""
        by_another = isinstance(error, WrongSource)
        self._count("refused" if by_another else "malformed")
        about = f"{error.values['key']} {error.source if by_another else ''}"
        # A flood of them must fill neither the inbox nor the logs.
        if (untold := self._telling.due(about, self.clock())) is not None:
            self.post(lambda: self._tell_malformed(error, untold))

    # --- inside ---------------------------------------------------------------------------

    def _count(self, name: str) -> None:
        with self._counting:
            self.counts[name] += 1

    def count_refusal(self, name: str) -> None:
        """Count what was refused, by its name; from any thread."""
        with self._counting:
            self.refusals[name] += 1

    def _refuse(self, call: Call[Any, Any], error: TooManyQueries) -> None:
        # Not mirrored: the flood would go on as one of mirrors.
        self.count_refusal(error.counted_as)
        call.fail(error)
        self.tell(f"query {error.values['key']}", "warning", str(error), key=error.values["key"])

    def _tell_malformed(self, error: MalformedMessage, untold: int) -> None:
        key = str(error.values["key"])
        if not isinstance(error, WrongSource):
            self.log.warning("malformed message dropped", problem=f"{error}{and_more(untold)}")
        elif self._told_of.is_first(error.kind, error.source):
            self.log.error("message refused", key=key, problem=str(error))
        topic = topic_of(key)
        if isinstance(error, WrongSource) or (topic is not None and topic.qos is Qos.COMMAND):
            # Whoever leads an arm learns why it does not follow, whatever was wrong.
            self.report_fault(key, error)

    def _answer(self, handler: Callable[[Any], Any], pending: Deferred[Any, Any]) -> None:
        self._guarded(pending, lambda: pending.reply(handler(pending.request)))

    def _guarded(self, pending: Deferred[Any, Any], job: Callable[[], None]) -> None:
        try:
            job()
        except FrasError as error:
            pending.fail(error)
        except Exception as error:
            self.log.exception("a query failed unexpectedly")
            pending.fail(InternalFault(f"{type(error).__name__}: {error}"))

    def _receive(self, topic: Topic[M], handler: Callable[[M], None], message: M) -> None:
        # A family's callback does not learn the key, so its streams can't be told apart.
        if "{" not in topic.key:
            # Before the gate, for what it drops has arrived all the same.
            self.counts["gaps"] += self._gaps.before(topic.key, message.source, message.seq)
        self._dispatch(topic, handler, message)

    def _dispatch(self, topic: Topic[M], handler: Callable[[M], None], message: M) -> None:
        if topic.in_trial and not self.gate.admit((topic, handler), message):
            return
        self.counts["received"] += 1
        try:
            if topic.qos is Qos.COMMAND:
                self._freshness.require(topic.key, message, self._clock_ns())
            handler(message)
        except FrasError as error:
            # Refused for what it says; anything else is our own mistake and ends the process.
            self.counts["refused"] += 1
            about = f"{topic.key} {error.kind} {message.source}"
            if not isinstance(error, StaleCommand):
                self.tell(about, "error", "message refused", key=topic.key, problem=str(error))
            elif self._told_of.is_first(error.kind, message.source):
                self.log.error("message refused", key=topic.key, problem=str(error))
            self.report_fault(topic.key, error, trial=message.trial, tick=message.tick)

    def _on_drop(self, route: tuple[Topic[Any], Any], message: Header, serves: str) -> None:
        error = AnotherTrial(message.trial, serves)
        self.report_fault(route[0].key, error, trial=message.trial, tick=message.tick)

    def _on_token(self, token: str, present: bool) -> None:
        self._presence.note(token, present)
        self._become_ready()

    def _become_ready(self) -> None:
        if self._presence.becomes_ready():
            self.bus.announce(f"ready/{self.name}")
            self.log.info("ready")
