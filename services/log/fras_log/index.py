"""Whether the index of a log is that of its data: a reader that seeks trusts it alone."""

import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    MetadataIndex,
    Schema,
    Statistics,
)

from fras_log.chunks import Chunk
from fras_log.events import Broken

_MESSAGE_INDEX = struct.Struct("<HI")
_ENTRY_BYTES = 16


@dataclass
class Index:
    """What the data hold, and what the end of the file says that they hold.

    Attributes
    ----------
    schemas, channels : dict
        Of the data, by number.
    """

    schemas: dict[int, Schema] = field(default_factory=dict[int, Schema])
    channels: dict[int, Channel] = field(default_factory=dict[int, Channel])
    _chunks: dict[int, ChunkIndex] = field(default_factory=dict[int, ChunkIndex])
    _pointers: set[tuple[Opcode, int, int, str]] = field(
        default_factory=set[tuple[Opcode, int, int, str]]
    )
    _counts: Counter[int] = field(default_factory=Counter[int])
    _open: ChunkIndex | None = None
    _lost: bool = False
    _entries: dict[int, bytes] = field(default_factory=dict[int, bytes])
    _told_schemas: dict[int, Schema] = field(default_factory=dict[int, Schema])
    _told_channels: dict[int, Channel] = field(default_factory=dict[int, Channel])
    _told_chunks: dict[int, ChunkIndex] = field(default_factory=dict[int, ChunkIndex])
    _told_pointers: set[tuple[Opcode, int, int, str]] = field(
        default_factory=set[tuple[Opcode, int, int, str]]
    )
    _told_statistics: Statistics | None = None

    # --- the data -------------------------------------------------------------------------

    def define(self, record: Schema | Channel) -> str:
        """Take a definition in the data; what is wrong with it, or nothing."""
        known: dict[int, Any] = self.schemas if isinstance(record, Schema) else self.channels
        before = known.setdefault(record.id, record)
        if before == record:
            return ""
        return f"{type(record).__name__.lower()} {record.id} is defined twice, and differently"

    def chunk(self, offset: int, length: int, chunk: Chunk) -> None:
        """Take a chunk whose records were all read."""
        self._open = ChunkIndex(
            chunk_start_offset=offset,
            chunk_length=length,
            message_start_time=chunk.start_time,
            message_end_time=chunk.end_time,
            message_index_offsets={},
            message_index_length=0,
            compression=chunk.compression,
            compressed_size=chunk.compressed_size,
            uncompressed_size=len(chunk.data),
        )
        self._chunks[offset] = self._open
        self._entries = {number: bytes(one) for number, one in chunk.entries.items()}
        self._counts.update(
            {number: len(one) // _ENTRY_BYTES for number, one in chunk.entries.items()}
        )

    def message_index(self, offset: int, length: int, content: bytes) -> str:
        """Take the index of a channel in the latest chunk; what is wrong with it, or nothing."""
        wrong = "this is not the index of the messages in the chunk before"
        if len(content) < _MESSAGE_INDEX.size:
            return wrong
        number, size = _MESSAGE_INDEX.unpack_from(content)
        told = content[_MESSAGE_INDEX.size :]
        if self._lost:
            return ""
        if self._open is None or len(told) != size or self._entries.pop(number, b"") != told:
            return wrong
        self._open.message_index_offsets[number] = offset
        self._open.message_index_length += length
        return ""

    def leave_chunk(self) -> str:
        """Note that no more index of the latest chunk comes; what is missing, or nothing."""
        missing, self._entries, self._open, self._lost = self._entries, {}, None, False
        return f"{len(missing)} channels of the chunk before have no index" if missing else ""

    def lose(self) -> None:
        """Note damage here: what indexes a lost chunk can't be held against it."""
        self._entries, self._open, self._lost = {}, None, True

    def point(self, opcode: Opcode, offset: int, length: int, name: str) -> None:
        """Take an attachment or a metadata record of the data."""
        self._pointers.add((opcode, offset, length, name))

    # --- the end --------------------------------------------------------------------------

    def told(self, record: Any) -> None:
        """Take a record of the index."""
        match record:
            case Schema():
                self._told_schemas[record.id] = record
            case Channel():
                self._told_channels[record.id] = record
            case ChunkIndex():
                self._told_chunks[record.chunk_start_offset] = record
            case AttachmentIndex(offset=offset, length=length, name=name):
                self._told_pointers.add((Opcode.ATTACHMENT, offset, length, name))
            case MetadataIndex(offset=offset, length=length, name=name):
                self._told_pointers.add((Opcode.METADATA, offset, length, name))
            case Statistics():
                self._told_statistics = record
            case _:
                pass

    def problems(self, offset: int) -> Iterator[Broken]:
        """Say what the index at `offset` tells that is not so."""
        pairs = {
            "chunks": (self._chunks, self._told_chunks),
            "schemas": (self.schemas, self._told_schemas),
            "channels": (self.channels, self._told_channels),
            "attachments and metadata": (self._pointers, self._told_pointers),
        }
        for what, (found, told) in pairs.items():
            if found != told:
                text = f"the index and the data differ in their {what}"
                yield Broken(offset, text, loses=False)
        if self._told_statistics != self._statistics():
            told_count = self._told_statistics.message_count if self._told_statistics else 0
            text = (
                f"the index counts {told_count} messages of which there are "
                f"{self._counts.total()}, or lies about their times"
            )
            yield Broken(offset, text, loses=False)

    def _statistics(self) -> Statistics:
        chunks = self._chunks.values()
        kinds = Counter(opcode for opcode, *_ in self._pointers)
        return Statistics(
            attachment_count=kinds[Opcode.ATTACHMENT],
            channel_count=len(self.channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunks),
            message_count=self._counts.total(),
            message_end_time=max((one.message_end_time for one in chunks), default=0),
            message_start_time=min((one.message_start_time for one in chunks), default=0),
            metadata_count=kinds[Opcode.METADATA],
            schema_count=len(self.schemas),
        )
