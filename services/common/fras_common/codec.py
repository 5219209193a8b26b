"""Bytes to messages and back: MessagePack through msgspec, validated, with schemas."""

import functools
import hashlib
import re
import threading
from collections.abc import Callable
from typing import Annotated, Any, TypeVar

import msgspec

from fras_common.errors import FrasError

T = TypeVar("T")

_PATH = re.compile(r" - at `(\$.*)`$")
MAX_MESSAGE_BYTES = 64 * 1024 * 1024


class MalformedMessage(FrasError):
    """A payload that is not what its key promises."""

    def __init__(self, key: str, path: str, problem: str) -> None:
        super().__init__(f"{key}: {path}: {problem}", key=key, path=path, problem=problem)


_encoder = msgspec.msgpack.Encoder()


def encode(message: object) -> bytes:
    """Encode a message, request or reply."""
    return _encoder.encode(message)


_making = threading.Lock()


@functools.cache
def _decoder(kind: type[Any]) -> Callable[[bytes], Any]:
    # Two threads that make decoders of types with a part in common end the process: the library
    # shows the one what the other has half made.
    with _making:
        return msgspec.msgpack.Decoder(kind).decode


def decode(kind: type[T], payload: bytes, key: str, most_bytes: int = MAX_MESSAGE_BYTES) -> T:
    """Decode and validate `payload`, received on `key`, of at most `most_bytes`.

    Raises
    ------
    MalformedMessage
        With the path of the field that is wrong (`$.seq`) and what was expected.
    """
    if len(payload) > most_bytes:
        raise MalformedMessage(
            key, "$", f"{len(payload)} bytes, more than the {most_bytes} allowed"
        )
    try:
        return _decoder(kind)(payload)
    except (msgspec.DecodeError, ValueError, OverflowError, RecursionError) as error:
        text = str(error)
        found = _PATH.search(text)
        path = found.group(1) if found else "$"
        raise MalformedMessage(key, path, _PATH.sub("", text)) from error


class HeaderFields(msgspec.Struct):
    """The header of any message, in the ranges that a log can hold; the rest is skipped."""

    stamp_ns: Annotated[int, msgspec.Meta(ge=0)]
    tick: int
    seq: Annotated[int, msgspec.Meta(ge=0, lt=2**32)]
    source: str
    trial: str


_header_decoder = msgspec.msgpack.Decoder(HeaderFields)


def read_header(payload: bytes) -> HeaderFields | None:
    """Read the header of a payload, or None where it has none that is whole and in range."""
    try:
        return _header_decoder.decode(payload)
    except (msgspec.DecodeError, ValueError, OverflowError, RecursionError):
        return None


def json_schema(kind: type[Any]) -> dict[str, Any]:
    """JSON Schema (2020-12) of a message type; byte fields are described as base64 strings."""
    return msgspec.json.schema(kind)


def content_digest(*values: object) -> str:
    """SHA-256 over the encoded values, each length-prefixed, as hexadecimal text."""
    digest = hashlib.sha256()
    for value in values:
        part = encode(value)
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return digest.hexdigest()
