"""A log as a sequence of events, whole or damaged: where each stands in the file, what is broken.

Nothing is taken on trust: records are framed here, because the library does not say where one
stands, and every checksum that covers them is computed. After damage the scan goes on where the
next whole piece begins.
"""

import mmap
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Metadata,
    Schema,
    Statistics,
)
from mcap.stream_reader import CRCValidationError, get_chunk_data_stream

from fras_log.errors import NoSuchLog, NotAnMcap

MAGIC = b"\x89MCAP0\r\n"
_FRAME = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_FOOTER_TAIL = struct.Struct("<BQQQ")
# Before the compression's name in a chunk: three numbers of 8 bytes, one of 4.
_BEFORE_COMPRESSION = 3 * 8 + 4
_ZSTD = struct.pack("<I", 4) + b"zstd"
_KNOWN = frozenset(int(opcode) for opcode in Opcode)
# A record larger than this is a damaged length.
_MOST_BYTES = 2**31
# What the library raises where bytes are damaged, depending on where that is.
_DAMAGE = (
    McapError,
    CRCValidationError,
    UnicodeDecodeError,
    struct.error,
    zstandard.ZstdError,
    ValueError,
    IndexError,
    KeyError,
    OverflowError,
    MemoryError,
)


@dataclass(frozen=True, slots=True)
class Recorded:
    """A message.

    Parameters
    ----------
    offset : int
        Of its chunk in the file.
    topic, schema : str
        Key and name of the schema, empty where it has none.
    encoding : str
        What the channel says of how it travelled.
    log_time, publish_time, sequence
        As the file has them.
    payload : bytes
        As it travelled.
    """

    offset: int
    topic: str
    schema: str
    encoding: str
    log_time: int
    publish_time: int
    sequence: int
    payload: bytes


@dataclass(frozen=True, slots=True)
class Told:
    """A metadata record."""

    offset: int
    name: str
    content: dict[str, str]


@dataclass(frozen=True, slots=True)
class Attached:
    """An attachment."""

    offset: int
    name: str
    content: bytes


@dataclass(frozen=True, slots=True)
class Broken:
    """Damage.

    Parameters
    ----------
    offset : int
        Where it was noticed.
    text : str
        What is wrong.
    """

    offset: int
    text: str


@dataclass(frozen=True, slots=True)
class Ended:
    """The file's end as it should be: footer, checksums, index and all."""

    offset: int


Event = Recorded | Told | Attached | Broken | Ended


def scan(path: Path) -> Iterator[Event]:
    """Yield what a file holds, in its order.

    Parameters
    ----------
    path : Path
        Opened for reading alone.

    Raises
    ------
    NoSuchLog
        It can't be opened.
    NotAnMcap
        It does not begin as an MCAP file does.
    """
    try:
        file = path.open("rb")
    except OSError as error:
        raise NoSuchLog(path, error.strerror or str(error)) from error
    with file:
        try:
            data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        except ValueError as error:
            raise NotAnMcap(path, "it is empty") from error
        except OSError as error:
            raise NoSuchLog(path, error.strerror or str(error)) from error
        with data:
            if data[: len(MAGIC)] != MAGIC:
                raise NotAnMcap(path, "it does not begin with MCAP's magic bytes")
            yield from _Scan(data).events()


@dataclass(frozen=True)
class _Frame:
    offset: int
    opcode: int
    start: int
    end: int


class _Scan:
    def __init__(self, data: mmap.mmap) -> None:
        self._data = data
        self._size = len(data)
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, Channel] = {}
        self._chunks: set[int] = set()
        self._indexed: set[int] = set()
        self._messages = 0
        self._counted = -1
        self._data_end = -1
        self._unknown_channels = 0

    def events(self) -> Iterator[Event]:
        position = len(MAGIC)
        self._learn_from_summary()
        while position < self._size:
            frame = self._frame(position)
            if isinstance(frame, Broken):
                yield frame
                position = self._next_chunk(position + 1)
                if position < 0:
                    return
                continue
            if frame.opcode == Opcode.FOOTER:
                yield from self._finish(frame)
                return
            yield from self._read(frame)
            position = frame.end
        yield Broken(self._size, "the file ends without a footer: it was cut, or never closed")

    def _frame(self, position: int) -> _Frame | Broken:
        if position + _FRAME.size > self._size:
            return Broken(position, f"the file ends within a record, after {self._size} bytes")
        opcode, length = _FRAME.unpack_from(self._data, position)
        start = position + _FRAME.size
        if opcode not in _KNOWN or length > _MOST_BYTES:
            return Broken(position, f"no record begins here (kind {opcode}, {length} bytes)")
        if start + length > self._size:
            return Broken(
                position,
                f"the file ends within a record of {length} bytes, after {self._size} bytes",
            )
        return _Frame(position, opcode, start, start + length)

    def _next_chunk(self, position: int) -> int:
        """Find where the next chunk begins that is whole; -1 if there is none."""
        while (found := self._data.find(_ZSTD, position)) >= 0:
            offset = found - _BEFORE_COMPRESSION - _FRAME.size
            position = found + 1
            if offset < len(MAGIC) or self._data[offset] != Opcode.CHUNK:
                continue
            frame = self._frame(offset)
            if isinstance(frame, _Frame):
                return offset
        return -1

    def _read(self, frame: _Frame) -> Iterator[Event]:
        try:
            match frame.opcode:
                case Opcode.CHUNK:
                    self._chunks.add(frame.offset)
                    yield from self._read_chunk(frame)
                case Opcode.METADATA:
                    record = Metadata.read(self._stream(frame))
                    yield Told(frame.offset, record.name, dict(record.metadata))
                case Opcode.ATTACHMENT:
                    yield from self._read_attachment(frame)
                case Opcode.DATA_END:
                    yield from self._read_data_end(frame)
                case Opcode.CHUNK_INDEX:
                    self._indexed.add(ChunkIndex.read(self._stream(frame)).chunk_start_offset)
                case Opcode.STATISTICS:
                    self._counted = Statistics.read(self._stream(frame)).message_count
                case Opcode.SCHEMA:
                    self._take(Schema.read(self._stream(frame)))
                case Opcode.CHANNEL:
                    self._take(Channel.read(self._stream(frame)))
                case Opcode.HEADER:
                    Header.read(self._stream(frame))
                case _:
                    pass
        except _DAMAGE as error:
            kind = type(error).__name__
            yield Broken(frame.offset, f"a record that can't be read ({kind}: {error})")

    def _read_chunk(self, frame: _Frame) -> Iterator[Event]:
        chunk = Chunk.read(self._stream(frame))
        # All of it or nothing: a chunk whose checksum is wrong is no evidence.
        stream, size = get_chunk_data_stream(chunk, validate_crc=True)
        data = stream.read(size)
        unknown = position = 0
        while position < size:
            opcode, length = _FRAME.unpack_from(data, position)
            start = position + _FRAME.size
            position = start + length
            if opcode != Opcode.MESSAGE:
                self._take_inside(opcode, data[start:position])
                continue
            self._messages += 1
            number, sequence, log_time, publish_time = _MESSAGE.unpack_from(data, start)
            channel = self._channels.get(number)
            if channel is None:
                unknown += 1
                continue
            yield Recorded(
                frame.offset,
                channel.topic,
                self._schemas.get(channel.schema_id, ""),
                channel.metadata.get("zenoh_encoding", ""),
                log_time,
                publish_time,
                sequence,
                data[start + _MESSAGE.size : position],
            )
        if unknown:
            text = f"{unknown} messages of this chunk are of keys that an earlier, lost piece named"
            yield Broken(frame.offset, text)

    def _read_attachment(self, frame: _Frame) -> Iterator[Event]:
        record = Attachment.read(self._stream(frame))
        covered = zlib.crc32(self._data[frame.start : frame.end - 4])
        (told,) = struct.unpack_from("<I", self._data, frame.end - 4)
        if told not in (0, covered):
            yield Broken(frame.offset, f"the checksum of attachment {record.name!r} is wrong")
        yield Attached(frame.offset, record.name, record.data)

    def _read_data_end(self, frame: _Frame) -> Iterator[Event]:
        self._data_end = frame.offset
        told = DataEnd.read(self._stream(frame)).data_section_crc
        with memoryview(self._data) as view, view[: frame.offset] as data:
            covered = zlib.crc32(data)
        if told != covered:
            yield Broken(frame.offset, "the checksum over all data is wrong: bytes were changed")

    def _finish(self, frame: _Frame) -> Iterator[Event]:
        try:
            footer = Footer.read(self._stream(frame))
        except _DAMAGE as error:
            yield Broken(frame.offset, f"the footer can't be read ({type(error).__name__})")
            return
        problems = list(self._problems_of_the_end(frame, footer))
        yield from problems
        if not problems:
            yield Ended(frame.offset)

    def _problems_of_the_end(self, frame: _Frame, footer: Footer) -> Iterator[Broken]:
        if self._data_end < 0:
            yield Broken(frame.offset, "the data's end is not marked")
        if frame.end - frame.start != _FOOTER_TAIL.size - _FRAME.size + 4 or not (
            self._data_end < footer.summary_start <= frame.offset
        ):
            yield Broken(frame.offset, "the footer points to no summary")
            return
        with memoryview(self._data) as view, view[footer.summary_start : frame.offset] as summary:
            covered = zlib.crc32(summary)
        head = self._data[frame.offset : frame.offset + _FOOTER_TAIL.size]
        if footer.summary_crc != zlib.crc32(head, covered):
            yield Broken(frame.offset, "the checksum over the index is wrong: bytes were changed")
        if self._data[frame.end :] != MAGIC:
            yield Broken(frame.end, "the file does not end with MCAP's magic bytes alone")
        if self._indexed != self._chunks:
            lost = len(self._indexed ^ self._chunks)
            yield Broken(footer.summary_start, f"the index and the data differ by {lost} chunks")
        if self._counted != self._messages:
            text = f"the index counts {self._counted} messages, there are {self._messages}"
            yield Broken(footer.summary_start, text)

    def _learn_from_summary(self) -> None:
        """Take keys from the index at the end, so that a lost first chunk costs only itself."""
        tail = self._size - len(MAGIC) - _FRAME.size - 20
        frame = self._frame(tail) if tail > len(MAGIC) else None
        if not isinstance(frame, _Frame) or frame.opcode != Opcode.FOOTER:
            return
        position = struct.unpack_from("<Q", self._data, frame.start)[0]
        while len(MAGIC) < position < tail:
            one = self._frame(position)
            if isinstance(one, Broken):
                return
            try:
                if one.opcode == Opcode.SCHEMA:
                    self._take(Schema.read(self._stream(one)))
                elif one.opcode == Opcode.CHANNEL:
                    self._take(Channel.read(self._stream(one)))
            except _DAMAGE:
                # The scan itself will come here and say so.
                return
            position = one.end

    def _take_inside(self, opcode: int, content: bytes) -> None:
        kind = {Opcode.SCHEMA: Schema, Opcode.CHANNEL: Channel}.get(Opcode(opcode))
        if kind is not None:
            self._take(kind.read(ReadDataStream(BytesIO(content))))

    def _take(self, record: Any) -> None:
        if isinstance(record, Schema):
            self._schemas[record.id] = record.name
        elif isinstance(record, Channel):
            self._channels[record.id] = record

    def _stream(self, frame: _Frame) -> ReadDataStream:
        return ReadDataStream(BytesIO(self._data[frame.start : frame.end]))
