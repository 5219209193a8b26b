"""Between Zenoh's types and ours: samples, calls, answers, a session's settings."""

# The wheel's stubs leave handler types open.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

import json
from typing import Any, TypeVar

import zenoh

from fras_common.bus.contract import NoAnswer, RawSample, RemoteFault
from fras_common.bus.past import CACHES, Beat, Cached
from fras_common.bus.settings import Settings
from fras_common.codec import MalformedMessage, decode, encode
from fras_common.errors import FrasError
from fras_common.messages import Fault
from fras_common.topics import Query

__all__ = ["ENCODING", "ZenohCall", "beat", "configured", "numbered", "outcome", "raw"]

Rep = TypeVar("Rep")

ENCODING = zenoh.Encoding("application/msgpack")
# A publisher's latest number, as four bytes.
BEAT_BYTES = 4


class ZenohCall:
    """A question to be answered once."""

    def __init__(self, asked: zenoh.Query, request: Any) -> None:
        self.request = request
        self._asked = asked

    def reply(self, reply: object) -> None:
        """Answer."""
        self._asked.reply(self._asked.key_expr, encode(reply), encoding=ENCODING)
        self._asked.drop()

    def fail(self, error: FrasError) -> None:
        """Refuse."""
        fault = Fault(kind=error.kind, text=str(error))
        self._asked.reply_err(encode(fault), encoding=ENCODING)
        self._asked.drop()


def raw(sample: zenoh.Sample) -> RawSample:
    """Take a sample as it stood on the wire."""
    return RawSample(str(sample.key_expr), sample.payload.to_bytes(), str(sample.encoding))


def numbered(sample: zenoh.Sample) -> Cached | None:
    """Take a sample with its publisher's number, if it bears one."""
    if (info := sample.source_info) is None:
        return None
    return Cached(raw(sample), f"{info.source_id.zid}/{info.source_id.eid}", info.source_sn)


def beat(sample: zenoh.Sample) -> Beat | None:
    """Take a publisher's latest number; anybody may say something else there, which tells none."""
    payload = sample.payload.to_bytes()
    key, _, name = str(sample.key_expr).partition(CACHES)
    if len(payload) != BEAT_BYTES:
        return None
    return Beat(key, "/".join(name.split("/")[:2]), int.from_bytes(payload, "little"))


def outcome(query: Query[Any, Rep], reply: zenoh.Reply, timeout_s: float) -> Rep | FrasError:
    """Decode an answer, or say why there is none."""
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


def configured(settings: Settings) -> zenoh.Config:
    """Make Zenoh's own of settings."""
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config
