"""What every implementation of the bus does alike: stamping, checking, outcomes into errors."""

import itertools
import threading
from collections.abc import Callable, Iterable
from typing import Any, Generic, Protocol, TypeVar

import msgspec

from fras_common.bus.contract import NoAnswer, OnMalformed, RawSample
from fras_common.codec import MalformedMessage, decode
from fras_common.errors import FrasError
from fras_common.messages import Header
from fras_common.provenance import require_source
from fras_common.topics import Query, Topic

M = TypeVar("M", bound=Header)
T = TypeVar("T")
Rep = TypeVar("Rep")


class Stamper:
    """Fills the header fields that belong to the publisher.

    Parameters
    ----------
    source : str
        Service and instance, `sim/3f2a`.
    clock_ns : callable
        Wall clock [ns since the Unix epoch].
    """

    def __init__(self, source: str, clock_ns: Callable[[], int]) -> None:
        self._source = source
        self._clock_ns = clock_ns
        self._count = itertools.count()

    def stamp(self, message: M) -> M:
        """Return the message with stamp, sequence number and source filled."""
        return msgspec.structs.replace(
            message, stamp_ns=self._clock_ns(), seq=next(self._count), source=self._source
        )


def received(topic: Topic[M], payload: bytes, key: str) -> M:
    """Decode what came in on a key of `topic`, if its source may speak there.

    Raises
    ------
    MalformedMessage
        It is not what its key promises; `WrongSource`: nor of whom.
    """
    message = decode(topic.type, payload, key, topic.max_bytes)
    require_source(key, message.source)
    return message


def decoding(
    topic: Topic[M], callback: Callable[[M], None], on_malformed: OnMalformed
) -> Callable[[RawSample], None]:
    """Return what takes the samples of `topic` and passes their messages to `callback`."""

    def deliver(sample: RawSample) -> None:
        try:
            message = received(topic, sample.payload, sample.key)
        except MalformedMessage as error:
            on_malformed(error)
        else:
            callback(message)

    return deliver


class Samples(Protocol):
    """What came on a key: the last ones, undecoded."""

    def take(self) -> Iterable[RawSample]:
        """Give those since the last time, oldest first."""
        ...

    def pause(self) -> None:
        """Hear nothing, and forget what was not taken."""
        ...

    def resume(self) -> None:
        """Hear again."""
        ...


class Kept(Generic[M]):
    """Decodes what came on a key, once it is looked at.

    Parameters
    ----------
    topic : Topic
    samples : Samples
    on_malformed : callable
        Gets a payload that did not fit.
    """

    def __init__(self, topic: Topic[M], samples: Samples, on_malformed: OnMalformed) -> None:
        self._topic = topic
        self._samples = samples
        self._on_malformed = on_malformed

    def pause(self) -> None:
        """Hear nothing, and forget what was not looked at."""
        self._samples.pause()

    def resume(self) -> None:
        """Hear again what is said from now on."""
        self._samples.resume()

    def take(self) -> list[M]:
        """Return the messages since the last look, oldest first."""
        taken: list[M] = []
        for sample in self._samples.take():
            try:
                taken.append(received(self._topic, sample.payload, sample.key))
            except MalformedMessage as error:
                self._on_malformed(error)
        return taken


class Answer(Generic[T]):
    """Collects the one outcome of a query; later ones are ignored."""

    def __init__(self, on_done: Callable[[T | FrasError], None]) -> None:
        self._on_done = on_done
        self._first = threading.Lock()

    def settle(self, outcome: T | FrasError) -> None:
        """Deliver the first outcome; reply and timeout race on threads of their own."""
        if self._first.acquire(blocking=False):
            self._on_done(outcome)

    def expire(self, key: str, timeout_s: float) -> None:
        """Deliver `NoAnswer` unless an outcome came before."""
        self.settle(NoAnswer(key, timeout_s))


def wait_for(
    ask: Callable[[Callable[[Rep | FrasError], None]], None],
    query: Query[Any, Rep],
    timeout_s: float,
) -> Rep:
    """Turn a non-blocking `ask` into a blocking one.

    Raises
    ------
    FrasError
        What the query ended with, if not with a reply.
    """
    done = threading.Event()
    outcomes: list[Rep | FrasError] = []

    def on_done(outcome: Rep | FrasError) -> None:
        outcomes.append(outcome)
        done.set()

    ask(on_done)
    # The bus itself ends the query in time; the margin only covers a bus that dies meanwhile.
    if not done.wait(timeout_s + 1.0):
        raise NoAnswer(query.key, timeout_s)
    outcome = outcomes[0]
    if isinstance(outcome, FrasError):
        raise outcome
    return outcome
