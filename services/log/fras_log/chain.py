"""The hash chain of a log: any change of any message, or of their order, changes its head.

A message's leaf is the SHA-256 of its times, number, channel (key, encodings and schema) and
bytes; the head after it is the SHA-256 of the head before and the leaf. The first head is that of
what stands before the messages: what the log says of itself, and its attachments. Every second or
so a checkpoint goes into the file: the head, a signature if there is a key, and the first bytes of
the leaves since the last one, which name the very message that was changed.
"""

import base64
import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256

LEAF_BYTES = 8
_DOMAIN = b"fras.chain.1\0"
_MESSAGE = struct.Struct("<QQI")
# Copied for one call of the hash less.
_SMALL_BYTES = 2048
_SIGNED = struct.Struct("<Q")


def leaf(channel: bytes, log_time: int, publish_time: int, sequence: int, payload: bytes) -> bytes:
    """Return the digest of one message.

    Parameters
    ----------
    channel : bytes
        Digest of its channel.
    log_time, publish_time : int
        Arrival and the producer's stamp [ns].
    sequence : int
        Its number, 0 to 2^32 - 1.
    payload : bytes
        As it travelled.
    """
    said = _MESSAGE.pack(log_time, publish_time, sequence) + channel
    if len(payload) < _SMALL_BYTES:
        return sha256(said + payload).digest()
    digest = sha256(said)
    digest.update(payload)
    return digest.digest()


def first_head(metadata: Mapping[str, str], attachments: Mapping[str, bytes]) -> bytes:
    """Return the head before the first message.

    Parameters
    ----------
    metadata : mapping of str to str
        The log's opening record.
    attachments : mapping of str to bytes
        Content by name.
    """
    digests = {name: sha256(data).hexdigest() for name, data in attachments.items()}
    said = json.dumps([dict(metadata), digests], sort_keys=True, ensure_ascii=True)
    return sha256(_DOMAIN + said.encode()).digest()


def next_head(head: bytes, one_leaf: bytes) -> bytes:
    """Return the head after one more message."""
    return sha256(head + one_leaf).digest()


def to_sign(messages: int, head: bytes) -> bytes:
    """Return what a signature is on: how many messages there are, and the head after them."""
    return _DOMAIN + _SIGNED.pack(messages) + head


def record_digest(content: Mapping[str, str]) -> str:
    """Return the digest of a metadata record, hexadecimal."""
    return sha256(_said(content)).hexdigest()


def closing_to_sign(content: Mapping[str, str]) -> bytes:
    """Return what the signature of the closing record is on: all of it but the signature."""
    unsigned = {name: value for name, value in content.items() if name != "signature"}
    return _DOMAIN + _said(unsigned)


def _said(content: Mapping[str, str]) -> bytes:
    return json.dumps(dict(content), sort_keys=True, ensure_ascii=True).encode()


@dataclass(frozen=True)
class Checkpoint:
    """Where the chain stands after some messages.

    Parameters
    ----------
    messages : int
        How many there are up to here.
    head : bytes
        Of the chain, after them.
    leaves : tuple of bytes
        First `LEAF_BYTES` of each leaf since the checkpoint before.
    signature : bytes
        Of `to_sign`, or empty.
    """

    messages: int
    head: bytes
    leaves: tuple[bytes, ...]
    signature: bytes = b""

    def as_metadata(self) -> dict[str, str]:
        """Content of the metadata record."""
        return {
            "messages": str(self.messages),
            "head": self.head.hex(),
            "leaves": base64.b64encode(b"".join(self.leaves)).decode(),
            "signature": base64.b64encode(self.signature).decode(),
        }

    @classmethod
    def of_metadata(cls, content: Mapping[str, str]) -> "Checkpoint":
        """Read a metadata record.

        Raises
        ------
        ValueError
            It is not one.
        """
        try:
            packed = base64.b64decode(content["leaves"], validate=True)
            signature = base64.b64decode(content["signature"], validate=True)
            messages, head = int(content["messages"]), bytes.fromhex(content["head"])
        except (KeyError, ValueError) as error:
            raise ValueError(f"no checkpoint: {type(error).__name__}: {error}") from error
        pieces = range(0, len(packed), LEAF_BYTES)
        leaves = tuple(packed[start : start + LEAF_BYTES] for start in pieces)
        checkpoint = cls(messages, head, leaves, signature)
        if checkpoint.as_metadata() != dict(content):
            raise ValueError("no checkpoint: it is not written as one")
        return checkpoint


@dataclass
class Chain:
    """A chain that grows.

    Parameters
    ----------
    head : bytes
        Before the first message.
    """

    head: bytes
    messages: int = 0
    _leaves: list[bytes] = field(default_factory=list[bytes])

    def add(self, one_leaf: bytes) -> None:
        """Take a message into account."""
        self.head = sha256(self.head + one_leaf).digest()
        self.messages += 1
        self._leaves.append(one_leaf[:LEAF_BYTES])

    @property
    def open(self) -> int:
        """Messages since the last checkpoint."""
        return len(self._leaves)

    def checkpoint(self) -> Checkpoint:
        """Close a stretch of the chain; the caller may add a signature."""
        leaves, self._leaves = tuple(self._leaves), []
        return Checkpoint(self.messages, self.head, leaves)


def first_difference(found: Sequence[bytes], told: Sequence[bytes]) -> int | None:
    """Index of the first leaf that is not the one that was told; None if all are."""
    for index, (one, other) in enumerate(zip(found, told, strict=False)):
        if one != other:
            return index
    return None if len(found) == len(told) else min(len(found), len(told))
