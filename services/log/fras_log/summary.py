"""What the end of a log says of its data: each thing once, and where it says that it does."""

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
    SummaryOffset,
)

_OPCODES = {
    Schema: Opcode.SCHEMA,
    Channel: Opcode.CHANNEL,
    Statistics: Opcode.STATISTICS,
    ChunkIndex: Opcode.CHUNK_INDEX,
    AttachmentIndex: Opcode.ATTACHMENT_INDEX,
    MetadataIndex: Opcode.METADATA_INDEX,
}

# What says where something stands in the data.
Pointer = MetadataIndex | AttachmentIndex


@dataclass
class Summary:
    """What the index says.

    Attributes
    ----------
    schemas, channels : dict
        By number.
    chunks, pointers : dict
        By where in the file they are.
    statistics : dict
        By 0.
    groups, found : dict of int to SummaryOffset
        Where the records of each kind stand, as it is told, and as it is.
    groups_start : int
        Where that is told; 0: nowhere.
    twice, scattered : str
        Kind of a record that came twice; of one that stands apart from its kind.
    """

    schemas: dict[int, Schema] = field(default_factory=dict[int, Schema])
    channels: dict[int, Channel] = field(default_factory=dict[int, Channel])
    chunks: dict[int, ChunkIndex] = field(default_factory=dict[int, ChunkIndex])
    pointers: dict[int, Pointer] = field(default_factory=dict[int, Pointer])
    statistics: dict[int, Statistics] = field(default_factory=dict[int, Statistics])
    groups: dict[int, SummaryOffset] = field(default_factory=dict[int, SummaryOffset])
    found: dict[int, SummaryOffset] = field(default_factory=dict[int, SummaryOffset])
    groups_start: int = 0
    twice: str = ""
    scattered: str = ""

    def take(self, offset: int, length: int, record: Any) -> None:
        """Take a record of the index."""
        known, name = self._place(record)
        what = type(record).__name__
        if name in known:
            self.twice = what
        known[name] = record
        if isinstance(record, SummaryOffset):
            self.groups_start = self.groups_start or offset
            return
        opcode = _OPCODES[type(record)]
        group = self.found.get(opcode)
        if group is None:
            self.found[opcode] = SummaryOffset(opcode, offset, length)
        elif group.group_start + group.group_length != offset:
            self.scattered = what
        else:
            self.found[opcode] = SummaryOffset(
                opcode, group.group_start, group.group_length + length
            )

    def _place(self, record: Any) -> tuple[dict[int, Any], int]:
        """Return where a record belongs, and by which number it is known there."""
        match record:
            case Schema():
                return self.schemas, record.id
            case Channel():
                return self.channels, record.id
            case ChunkIndex():
                return self.chunks, record.chunk_start_offset
            case AttachmentIndex() | MetadataIndex():
                return self.pointers, record.offset
            case SummaryOffset():
                return self.groups, record.group_opcode
            case _:
                return self.statistics, 0

    def problems(self, groups_start: int) -> Iterator[str]:
        """Say what is wrong with it in itself; `groups_start` is the footer's."""
        if self.twice:
            yield f"the index says twice what there is once ({self.twice})"
        groups = {opcode: one for opcode, one in self.groups.items() if one.group_length}
        if self.scattered or groups != self.found:
            yield "the index does not stand where it says that each kind does"
        if groups_start != self.groups_start:
            yield "the footer does not say where the index tells of its kinds"
