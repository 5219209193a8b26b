"""Queries as a service sees them: asked, admitted, answered now or later, mirrored."""

import threading
import time
from typing import TYPE_CHECKING, Generic, TypeVar

import msgspec

from fras_common.bus import Call
from fras_common.codec import encode
from fras_common.errors import FrasError
from fras_common.messages import Fault, RpcRecord
from fras_common.messages.service import NIL
from fras_common.topics import Query

if TYPE_CHECKING:
    from fras_common.service.host import ServiceHost

Req = TypeVar("Req")
Rep = TypeVar("Rep")


class Deferred(Generic[Req, Rep]):
    """A query whose answer comes later; the mirror is published when it does.

    Attributes
    ----------
    mirrored : bool
        Whether the exchange is mirrored; one of too many of a kind that is never refused is not.
    """

    def __init__(self, host: "ServiceHost", query: Query[Req, Rep], call: Call[Req, Rep]) -> None:
        self._host = host
        self._query = query
        self._call = call
        self._since_s = time.monotonic()
        self.mirrored = True

    @property
    def request(self) -> Req:
        """What was asked."""
        return self._call.request

    def reply(self, reply: Rep) -> None:
        """Answer, and mirror the exchange."""
        self._mirror(msgspec.Raw(encode(reply)), None)
        self._call.reply(reply)

    def fail(self, error: FrasError) -> None:
        """Answer with a typed error, and mirror the exchange."""
        self._mirror(NIL, Fault(kind=error.kind, text=str(error)))
        self._call.fail(error)

    def _mirror(self, reply: msgspec.Raw, fault: Fault | None) -> None:
        if not self.mirrored:
            return
        record = RpcRecord(
            trial=self._host.gate.trial,
            key=self._query.key,
            request=msgspec.Raw(encode(self._call.request)),
            reply=reply,
            fault=fault,
            duration_s=time.monotonic() - self._since_s,
        )
        if threading.get_ident() == self._host.loop_thread:
            # Before the answer, and before anything is done upon it: a kill must not lose it.
            self._host.publish_mirror(self._query, record)
        else:
            self._host.post(lambda: self._host.publish_mirror(self._query, record))
