"""Whether the index of a log is that of its data: a reader that seeks trusts it alone."""

import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    MetadataIndex,
    Schema,
    Statistics,
)

from fras_log.chunks import Chunk
from fras_log.events import Broken
from fras_log.summary import Pointer, Summary

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
    _pointers: dict[int, Pointer] = field(default_factory=dict[int, Pointer])
    _counts: Counter[int] = field(default_factory=Counter[int])
    _open: ChunkIndex | None = None
    _lost: bool = False
    _entries: dict[int, bytes] = field(default_factory=dict[int, bytes])
    _summary: Summary = field(default_factory=Summary)

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
        if self._open is None or len(told) != size or self._entries.pop(number, None) != told:
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

    def point(self, pointer: Pointer) -> None:
        """Take what the index has to say of a record of the data."""
        self._pointers[pointer.offset] = pointer

    def attach(self, offset: int, length: int, record: Attachment) -> None:
        """Take an attachment of the data."""
        self.point(
            AttachmentIndex(
                offset=offset,
                length=length,
                create_time=record.create_time,
                log_time=record.log_time,
                data_size=len(record.data),
                name=record.name,
                media_type=record.media_type,
            )
        )

    # --- the end --------------------------------------------------------------------------

    def told(self, offset: int, length: int, record: Any) -> None:
        """Take a record of the index."""
        self._summary.take(offset, length, record)

    def problems(self, offset: int, groups_start: int) -> Iterator[Broken]:
        """Say what the index at `offset` tells that is not so; `groups_start` is the footer's."""
        summary = self._summary
        pairs = {
            "chunks": (self._chunks, summary.chunks),
            "schemas": (self.schemas, summary.schemas),
            "channels": (self.channels, summary.channels),
            "attachments and metadata": (self._pointers, summary.pointers),
        }
        for what, (found, said) in pairs.items():
            if found != said:
                text = f"the index and the data differ in their {what}"
                yield Broken(offset, text, loses=False)
        statistics = summary.statistics.get(0)
        if statistics != self._statistics():
            text = (
                f"the index counts {statistics.message_count if statistics else 0} messages of "
                f"which there are {self._counts.total()}, or lies about their times"
            )
            yield Broken(offset, text, loses=False)
        for text in summary.problems(groups_start):
            yield Broken(offset, text, loses=False)
        if unused := self._unused():
            text = f"{unused} keys or schemas are defined of no message: no recorder does that"
            yield Broken(offset, text, loses=False)

    def _unused(self) -> int:
        schemas = {one.schema_id for one in self.channels.values()}
        return len(self.channels.keys() - self._counts.keys()) + len(self.schemas.keys() - schemas)

    def _statistics(self) -> Statistics:
        chunks = self._chunks.values()
        kinds = Counter(type(one) for one in self._pointers.values())
        return Statistics(
            attachment_count=kinds[AttachmentIndex],
            channel_count=len(self.channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunks),
            message_count=self._counts.total(),
            message_end_time=max((one.message_end_time for one in chunks), default=0),
            message_start_time=min((one.message_start_time for one in chunks), default=0),
            metadata_count=kinds[MetadataIndex],
            schema_count=len(self.schemas),
        )
