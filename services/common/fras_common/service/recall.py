"""What a service that starts again must know of the trial under way: it asks the recorder.

What is to be asked is a coroutine of questions, which knows no bus and no clock: it yields a
question and is sent what was remembered. `Recall` asks each of them until it is answered.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from fras_common import messages as m
from fras_common.codec import MalformedMessage, decode, read_header
from fras_common.errors import FrasError
from fras_common.service.host import ServiceHost
from fras_common.topics import RECORDER_LAST, RECORDER_SINCE, RPC, TASK_STATUS, Query, Topic

__all__ = [
    "Asked",
    "Last",
    "LastAsked",
    "Recall",
    "Recalling",
    "Since",
    "reset_under_way",
    "under_way",
]

M = TypeVar("M", bound=m.Header)

ANSWER_TIMEOUT_S = 2.0
RETRY_S = 0.25
# Questions that are kept until everything is recalled.
EARLY = 100
# Phases of a task in which no trial runs.
OVER = ("ended", "idle")


@dataclass(frozen=True)
class Last:
    """The last message of a key; sends back that, or None if none was heard."""

    topic: Topic[Any]


@dataclass(frozen=True)
class LastAsked:
    """The last mirror of a query, with its request and reply; sends back `Asked` or None."""

    query: Query[Any, Any]


@dataclass(frozen=True)
class Since:
    """The messages of a key from a tick on, of its latest trial; sends back a list of them."""

    topic: Topic[Any]
    tick: int


@dataclass(frozen=True)
class Asked:
    """A query as it was answered; no reply where that was a fault."""

    record: m.RpcRecord
    request: Any
    reply: Any


Question = Last | LastAsked | Since
# Malformed answers are thrown into it.
Recalling = Generator[Question, Any, Any]


def under_way() -> Recalling:
    """Return the last status of the trial under way, or None."""
    status: m.TaskStatus | None = yield Last(TASK_STATUS)
    return status if status is not None and status.phase not in OVER else None


def reset_under_way(query: Query[m.ResetRequest, m.ResetReply]) -> Recalling:
    """Return the mirror of the reset by which a service entered the trial under way, or None."""
    status: m.TaskStatus | None = yield from under_way()
    if status is None:
        return None
    asked: Asked | None = yield LastAsked(query)
    if asked is None or asked.reply is None or asked.request.trial != status.trial:
        return None
    return asked


class Recall:
    """Drives one coroutine of questions; the service is not ready before it has ended.

    Parameters
    ----------
    host : ServiceHost
    recalling : Recalling
        What to ask. An error that it does not catch is logged: the service goes on as one that
        knows nothing.
    take : callable
        Gets what it returns, before the service is ready.
    what : str
        Name of it, where a service recalls several things.
    """

    def __init__(
        self,
        host: ServiceHost,
        recalling: Recalling,
        take: Callable[[Any], None],
        what: str = "trial",
    ) -> None:
        self._host = host
        self._recalling: Recalling | None = recalling
        self._take_result = take
        self._done = host.not_before(f"recall: {what}")
        self._question: Question | None = None
        self._pages: list[bytes] = []
        self._asking = False
        self._ask_at_s = 0.0
        self._early: list[Callable[[], None]] = []
        host.require("recorder")

    @property
    def is_done(self) -> bool:
        """Whether everything was asked."""
        return self._recalling is None

    def keep(self, again: Callable[[], None]) -> bool:
        """Keep a question that comes before its answer can be known; it is asked again then.

        False if everything is recalled, or too many are kept.
        """
        if self.is_done or len(self._early) >= EARLY:
            return False
        self._early.append(again)
        return True

    def give_up(self) -> None:
        """Ask no more: what was to be recalled is over."""
        if self._recalling is not None:
            self._recalling.close()
            self._end()

    def wake(self, now_s: float) -> float | None:
        """Ask if it is time to; seconds until it is again, or None."""
        if self._recalling is None or self._asking:
            return None
        if not self._host.present("alive/recorder"):
            return RETRY_S
        if now_s < self._ask_at_s:
            return self._ask_at_s - now_s
        if self._question is None:
            self._go_on(None)
        if self._question is not None:
            self._ask_at_s = now_s + RETRY_S
            self._ask(self._question)
        return None

    def _ask(self, question: Question) -> None:
        self._asking = True
        if isinstance(question, Since):
            tick = question.tick
            if self._pages and (header := read_header(self._pages[-1])) is not None:
                tick = header.tick
            request: Any = m.SinceRequest(key=question.topic.key, tick=tick)
            query: Query[Any, Any] = RECORDER_SINCE
        else:
            key = question.query.mirror if isinstance(question, LastAsked) else question.topic.key
            request, query = m.LastRequest(key=key), RECORDER_LAST
        self._host.bus.ask(
            query,
            request,
            lambda answer: self._host.post(lambda: self._take(question, answer)),
            ANSWER_TIMEOUT_S,
        )

    def _take(self, question: Question, answer: m.LastReply | m.SinceReply | FrasError) -> None:
        self._asking = False
        if self._recalling is None:
            return
        if isinstance(answer, FrasError):
            self._host.log.warning("nothing can be recalled yet", problem=str(answer))
            return
        # What was answered was no failure: the next question need not wait.
        self._ask_at_s = 0.0
        if isinstance(answer, m.SinceReply):
            known = len(self._pages)
            self._pages += [one for one in answer.payloads if one not in self._pages[-1:]]
            if answer.more and len(self._pages) > known:
                return
        try:
            told = _told(question, answer, self._pages)
        except MalformedMessage as error:
            self._go_on(error)
        else:
            self._go_on(told)

    def _go_on(self, outcome: Any) -> None:
        recalling = self._recalling
        if recalling is None:
            return
        self._pages = []
        try:
            if isinstance(outcome, FrasError):
                self._question = recalling.throw(outcome)
            else:
                self._question = recalling.send(outcome)
        except StopIteration as end:
            self._take_result(end.value)
            self._end()
        except FrasError as error:
            self._host.log.error("the trial under way can't be taken up", problem=str(error))
            self._end()

    def _end(self) -> None:
        self._recalling = self._question = None
        self._done()
        early, self._early = self._early, []
        for again in early:
            self._host.post(again)


def _told(question: Question, answer: m.LastReply | m.SinceReply, pages: Sequence[bytes]) -> Any:
    """Decode what was remembered.

    Raises
    ------
    MalformedMessage
    """
    if isinstance(question, Since):
        return _messages(question.topic, pages)
    payload = answer.payload if isinstance(answer, m.LastReply) else b""
    if not payload:
        return None
    if isinstance(question, Last):
        return decode(question.topic.type, payload, question.topic.key)
    query = question.query
    record = decode(RPC.type, payload, query.mirror)
    request = decode(query.request, bytes(record.request), query.key)
    reply = decode(query.reply, bytes(record.reply), query.key) if record.fault is None else None
    return Asked(record, request, reply)


def _messages(topic: Topic[M], pages: Sequence[bytes]) -> list[M]:
    """Decode each message once, though two pages may hold it."""
    found: dict[tuple[str, int], M] = {}
    for payload in pages:
        message = decode(topic.type, payload, topic.key)
        found.setdefault((message.source, message.seq), message)
    return list(found.values())
