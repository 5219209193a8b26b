"""What a log says of all messages of a channel: key, encodings, schema."""

import functools
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

from mcap.records import Channel, Schema


@dataclass(frozen=True)
class Definition:
    """A channel.

    Parameters
    ----------
    topic, message_encoding : str
        Key without the cell, and how its payloads are written.
    metadata : tuple of (str, str)
        What else is said of it.
    schema, schema_encoding : str
        Name of the schema and how it is written; empty where there is none.
    schema_data : bytes
        The schema.
    """

    topic: str
    message_encoding: str = ""
    metadata: tuple[tuple[str, str], ...] = ()
    schema: str = ""
    schema_encoding: str = ""
    schema_data: bytes = b""

    @functools.cached_property
    def digest(self) -> bytes:
        """SHA-256 over all of it, each part after its length."""
        said = [self.topic, self.message_encoding, self.schema, self.schema_encoding]
        said += [text for pair in self.metadata for text in pair]
        digest = hashlib.sha256()
        for part in [*(text.encode() for text in said), self.schema_data]:
            digest.update(len(part).to_bytes(8, "little"))
            digest.update(part)
        return digest.digest()

    @functools.cached_property
    def encoding(self) -> str:
        """How its payloads travelled."""
        return dict(self.metadata).get("zenoh_encoding", "")


def definition_of(channel: Channel, schemas: Mapping[int, Schema]) -> Definition:
    """Return what a channel's record and that of its schema say."""
    metadata = tuple(channel.metadata.items())
    schema = schemas.get(channel.schema_id)
    if schema is None:
        return Definition(channel.topic, channel.message_encoding, metadata)
    return Definition(
        channel.topic,
        channel.message_encoding,
        metadata,
        schema.name,
        schema.encoding,
        schema.data,
    )
