"""A forger of logs: takes an MCAP file apart, and puts it together again with every checksum right.

It shares nothing with the code under test but the library's own records for the index.
"""

import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import BytesIO

import zstandard
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    McapRecord,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

MAGIC = b"\x89MCAP0\r\n"


@dataclass
class Piece:
    """A record; where the file has it, from `offset` to `end`."""

    opcode: int
    content: bytes
    offset: int = -1
    end: int = -1


class Garbage(Piece):
    """A record that the forger puts in without a look into it."""


@dataclass
class ChunkPiece(Piece):
    """A chunk with the records in it; `behind` come in the file after the index of its messages."""

    inside: list[Piece] = field(default_factory=list[Piece])
    behind: list[MessageIndex] = field(default_factory=list[MessageIndex])
    times: tuple[int, int] | None = None

    @property
    def messages(self) -> list[Piece]:
        return [one for one in self.inside if one.opcode == Opcode.MESSAGE]


def frames(data: bytes, position: int = len(MAGIC)) -> Iterator[Piece]:
    """Each record of a file, or of a chunk."""
    while position + 9 <= len(data) and data[position:] != MAGIC:
        opcode, length = struct.unpack_from("<BQ", data, position)
        end = position + 9 + length
        yield Piece(opcode, data[position + 9 : end], position, end)
        position = end


def _opened(piece: Piece) -> Piece:
    if piece.opcode != Opcode.CHUNK:
        return piece
    body = zstandard.decompress(piece.content[8 * 3 + 4 + 4 + 4 + 8 :])
    return ChunkPiece(Opcode.CHUNK, piece.content, piece.offset, piece.end, list(frames(body, 0)))


def take_apart(data: bytes) -> list[Piece]:
    """The records of the data section, chunks opened, without what only indexes them."""
    pieces: list[Piece] = []
    for piece in frames(data):
        if piece.opcode == Opcode.DATA_END:
            break
        if piece.opcode != Opcode.MESSAGE_INDEX:
            pieces.append(_opened(piece))
    return pieces


def chunks(pieces: list[Piece]) -> list[ChunkPiece]:
    """Those among them."""
    return [one for one in pieces if isinstance(one, ChunkPiece)]


def metadata(name: str, content: dict[str, str]) -> Piece:
    """A metadata record."""
    builder = RecordBuilder()
    Metadata(name=name, metadata=content).write(builder)
    return Piece(Opcode.METADATA, builder.end()[9:])


def attachment(name: str, data: bytes, like: Attachment) -> Piece:
    """An attachment with the times of another."""
    builder = RecordBuilder()
    Attachment(
        create_time=like.create_time,
        log_time=like.log_time,
        name=name,
        media_type=like.media_type,
        data=data,
    ).write(builder)
    return Piece(Opcode.ATTACHMENT, builder.end()[9:])


def read(piece: Piece) -> Metadata | Attachment:
    """The record that a piece holds."""
    kind = {Opcode.METADATA: Metadata, Opcode.ATTACHMENT: Attachment}[Opcode(piece.opcode)]
    return kind.read(_stream(piece.content))


def message(like: Piece, payload: bytes) -> Piece:
    """A message with the channel, number and times of another."""
    return Piece(Opcode.MESSAGE, like.content[:22] + payload)


def _stream(content: bytes) -> ReadDataStream:
    return ReadDataStream(BytesIO(content))


Groups = dict[Opcode, list[McapRecord]]
"""The index of a file, by kind of record."""


class _Rebuilt:
    def __init__(self) -> None:
        self.data = bytearray(MAGIC)
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.chunks: list[ChunkIndex] = []
        self.attachments: list[AttachmentIndex] = []
        self.metadata: list[MetadataIndex] = []
        self.counts: Counter[int] = Counter()

    def add(self, opcode: int, content: bytes) -> int:
        offset = len(self.data)
        self.data += struct.pack("<BQ", opcode, len(content)) + content
        return offset

    def add_chunk(self, chunk: ChunkPiece) -> None:
        inside, body = chunk.inside, bytearray()
        entries: dict[int, list[tuple[int, int]]] = {}
        for piece in inside:
            if piece.opcode == Opcode.MESSAGE:
                number, _, log_time = struct.unpack_from("<HIQ", piece.content)
                entries.setdefault(number, []).append((log_time, len(body)))
            elif isinstance(piece, Garbage):
                pass
            elif piece.opcode == Opcode.SCHEMA:
                schema = Schema.read(_stream(piece.content))
                self.schemas[schema.id] = schema
            elif piece.opcode == Opcode.CHANNEL:
                channel = Channel.read(_stream(piece.content))
                self.channels[channel.id] = channel
            body += struct.pack("<BQ", piece.opcode, len(piece.content)) + piece.content
        packed = zstandard.compress(bytes(body))
        times = [log_time for one in entries.values() for log_time, _ in one]
        first, last = chunk.times or (min(times), max(times))
        head = struct.pack("<QQQI", first, last, len(body), zlib.crc32(body))
        content = head + struct.pack("<I", 4) + b"zstd" + struct.pack("<Q", len(packed)) + packed
        offset = self.add(Opcode.CHUNK, content)
        offsets: dict[int, int] = {}
        index_start = len(self.data)
        own = [MessageIndex(number, records) for number, records in entries.items()]
        for one in [*own, *chunk.behind]:
            self.counts[one.channel_id] += len(one.records)
            builder = RecordBuilder()
            one.write(builder)
            offsets[one.channel_id] = self.add(Opcode.MESSAGE_INDEX, builder.end()[9:])
        self.chunks.append(
            ChunkIndex(
                chunk_start_offset=offset,
                chunk_length=9 + len(content),
                compression="zstd",
                compressed_size=len(packed),
                uncompressed_size=len(body),
                message_start_time=first,
                message_end_time=last,
                message_index_offsets=offsets,
                message_index_length=len(self.data) - index_start,
            )
        )

    def add_piece(self, piece: Piece) -> None:
        if isinstance(piece, ChunkPiece):
            self.add_chunk(piece)
            return
        content = piece.content
        if piece.opcode == Opcode.ATTACHMENT:
            content = content[:-4] + struct.pack("<I", zlib.crc32(content[:-4]))
        offset = self.add(piece.opcode, content)
        if piece.opcode == Opcode.METADATA:
            record = Metadata.read(_stream(content))
            index = MetadataIndex(offset=offset, length=9 + len(content), name=record.name)
            self.metadata.append(index)
        elif piece.opcode == Opcode.ATTACHMENT:
            told = Attachment.read(_stream(content))
            self.attachments.append(
                AttachmentIndex(
                    offset=offset,
                    length=9 + len(content),
                    create_time=told.create_time,
                    log_time=told.log_time,
                    data_size=len(told.data),
                    name=told.name,
                    media_type=told.media_type,
                )
            )

    def finish(self, forge: Callable[[Groups], None]) -> bytes:
        builder = RecordBuilder()
        DataEnd(zlib.crc32(self.data)).write(builder)
        self.data += builder.end()
        start = len(self.data)
        statistics = Statistics(
            attachment_count=len(self.attachments),
            channel_count=len(self.channels),
            channel_message_counts=dict(self.counts),
            chunk_count=len(self.chunks),
            message_count=self.counts.total(),
            message_end_time=max(one.message_end_time for one in self.chunks),
            message_start_time=min(one.message_start_time for one in self.chunks),
            metadata_count=len(self.metadata),
            schema_count=len(self.schemas),
        )
        groups: Groups = {
            Opcode.SCHEMA: [*self.schemas.values()],
            Opcode.CHANNEL: [*self.channels.values()],
            Opcode.STATISTICS: [statistics],
            Opcode.CHUNK_INDEX: [*self.chunks],
            Opcode.ATTACHMENT_INDEX: [*self.attachments],
            Opcode.METADATA_INDEX: [*self.metadata],
        }
        forge(groups)
        offsets: list[SummaryOffset] = []
        for opcode, records in groups.items():
            before = builder.count
            for record in records:
                record.write(builder)
            offsets.append(
                SummaryOffset(
                    group_opcode=opcode,
                    group_start=start + before,
                    group_length=builder.count - before,
                )
            )
        offset_start = start + builder.count
        for offset in offsets:
            offset.write(builder)
        summary = builder.end()
        head = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offset_start)
        Footer(start, offset_start, zlib.crc32(summary + head)).write(builder)
        return bytes(self.data) + summary + builder.end() + MAGIC


def put_together(
    pieces: list[Piece], forge: Callable[[Groups], None] = lambda groups: None
) -> bytes:
    """A file of these records, with index, counts and every checksum made anew.

    `forge` changes what the index says before it is written.
    """
    rebuilt = _Rebuilt()
    for piece in pieces:
        rebuilt.add_piece(piece)
    return rebuilt.finish(forge)


def repair_checksums(data: bytes) -> bytes:
    """The same bytes, but for the checksums over the data and over the index."""
    fixed = bytearray(data)
    ends = [one for one in frames(data) if one.opcode == Opcode.DATA_END]
    (footer,) = [one for one in frames(data) if one.opcode == Opcode.FOOTER]
    struct.pack_into("<I", fixed, ends[0].offset + 9, zlib.crc32(fixed[: ends[0].offset]))
    covered = fixed[ends[0].end : footer.offset + 9 + 16]
    struct.pack_into("<I", fixed, footer.offset + 9 + 16, zlib.crc32(covered))
    return bytes(fixed)
