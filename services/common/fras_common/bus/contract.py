"""What a bus promises. Tests run one contract suite on every implementation.

- Order holds within a key, not across keys: join by tick.
- Callbacks run on threads of the bus; they must only append to an inbox.
- A put never blocks for a slow or frozen subscriber.
- A payload that does not fit its key, or is not of whom the topic table says, reaches the
  `on_malformed` of the bus, never a callback; samples received raw are as they came.
- After `close` nothing is delivered and every call raises `BusClosed`; a question still open ends
  with `NoAnswer`.
- A publisher may be used from several threads: samples travel in the order of their `seq`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

from fras_common.codec import MalformedMessage
from fras_common.errors import FrasError
from fras_common.messages import Fault, Header
from fras_common.topics import Qos, Query, Topic

M = TypeVar("M", bound=Header)
M_co = TypeVar("M_co", bound=Header, covariant=True)
Req = TypeVar("Req")
Rep = TypeVar("Rep")
Req_co = TypeVar("Req_co", covariant=True)
Rep_contra = TypeVar("Rep_contra", contravariant=True)


class NoAnswer(FrasError):
    """Nobody serves the query, or not within the time allowed."""

    key: str

    def __init__(self, key: str, timeout_s: float) -> None:
        super().__init__(
            f"{key}: nobody answered, {timeout_s} s were allowed; is the service running?",
            key=key,
            timeout_s=timeout_s,
        )


class RemoteFault(FrasError):
    """The server refused or failed; `remote_kind` is the error's type over there."""

    remote_kind: str

    def __init__(self, key: str, fault: Fault) -> None:
        super().__init__(f"{key}: {fault.kind}: {fault.text}", key=key, remote_kind=fault.kind)


class BusClosed(FrasError):
    """The bus was used after it was closed."""


@dataclass(frozen=True)
class RawSample:
    """A sample as it stood on the wire, for who records verbatim."""

    key: str
    payload: bytes
    encoding: str


class Publisher(Protocol[M]):
    """Publishes one key; fills `stamp_ns`, `seq` and `source` of the header."""

    def put(self, message: M) -> M:
        """Publish, and return the message as it was stamped."""
        ...


class RawPublisher(Protocol):
    """Publishes bytes as they are: a log's samples keep the header of who sent them first."""

    def put(self, payload: bytes, encoding: str) -> None:
        """Publish."""
        ...

    def close(self) -> None:
        """Undeclare; what it kept for whoever comes later is forgotten. Idempotent."""
        ...


class Recent(Protocol[M_co]):
    """What was said last under a key; wakes nobody until it is looked at."""

    def take(self) -> Sequence[M_co]:
        """Return the messages since the last look, oldest first."""
        ...

    def pause(self) -> None:
        """Hear nothing, and forget what was not looked at; costs nobody anything. Idempotent."""
        ...

    def resume(self) -> None:
        """Hear again what is said from now on. Idempotent.

        Raises
        ------
        BusClosed
        """
        ...


class Call(Protocol[Req_co, Rep_contra]):
    """A query that waits for its answer; exactly one of `reply` and `fail` must be called."""

    @property
    def request(self) -> Req_co:
        """What was asked, decoded and validated."""
        ...

    def reply(self, reply: Rep_contra) -> None:
        """Answer."""
        ...

    def fail(self, error: FrasError) -> None:
        """Answer with an error that keeps its type's name."""
        ...


OnMalformed = Callable[[MalformedMessage], None]


class Bus(Protocol):
    """One participant's connection, within one cell."""

    def publisher(self, topic: Topic[M]) -> Publisher[M]:
        """Declare a publisher on a concrete key."""
        ...

    def publisher_raw(self, key: str, qos: Qos) -> RawPublisher:
        """Declare a publisher of bytes on any key, in the table or not."""
        ...

    def subscribe(self, topic: Topic[M], callback: Callable[[M], None]) -> None:
        """Receive every message of a key or family; latched topics deliver their last value."""
        ...

    def recent(self, topic: Topic[M], at_most: int) -> Recent[M]:
        """Look now and then at what came on a concrete key, of more than `at_most` at the last.

        What is lost on the way is not asked for.
        """
        ...

    def subscribe_raw(self, key_expr: str, callback: Callable[[RawSample], None]) -> None:
        """Receive samples undecoded, from now on; `cached` gives what came before."""
        ...

    def cached(
        self, key_expr: str, on_done: Callable[[list[RawSample]], None], timeout_s: float
    ) -> None:
        """Ask without waiting for all that publishers still cache; each one's come in order."""
        ...

    def serve(self, query: Query[Req, Rep], callback: Callable[[Call[Req, Rep]], None]) -> None:
        """Answer a query."""
        ...

    def ask(
        self,
        query: Query[Req, Rep],
        request: Req,
        on_done: Callable[[Rep | FrasError], None],
        timeout_s: float,
    ) -> None:
        """Ask without waiting; `on_done` gets the reply, `RemoteFault`, `NoAnswer` or malformed.

        Of several servers the first reply counts, and an error only if none replies.
        """
        ...

    def query(self, query: Query[Req, Rep], request: Req, timeout_s: float) -> Rep:
        """Ask and wait; raises what `ask` would deliver."""
        ...

    def announce(self, token: str) -> None:
        """Declare a liveliness token, e.g. `ready/sim`; it goes when this bus does."""
        ...

    def watch_tokens(self, callback: Callable[[str, bool], None]) -> None:
        """Report each token that appears (True) or goes (False), those present first."""
        ...

    def tokens(self, timeout_s: float) -> frozenset[str]:
        """Ask who is there now and wait for the whole answer; raises `NoAnswer` without a router.

        What was declared or put before, here, has reached the router when it returns.
        """
        ...

    def close(self) -> None:
        """Undeclare everything and close; idempotent."""
        ...
