"""A log as a sequence of events, whole or damaged: where each stands in the file, what is broken.

Nothing is taken on trust: records are framed here, because the library does not say where one
stands, and every checksum that covers them is computed. After damage the scan goes on where the
next whole piece begins.
"""

import re
import struct
import zlib
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from fras_log.channels import Definition, definition_of
from fras_log.chunks import FRAME, BadChunk, open_chunk
from fras_log.errors import NotAnMcap
from fras_log.events import Attached, Began, Broken, Cut, Ended, Event, Recorded, Told
from fras_log.index import Index
from fras_log.names import MEDIA_TYPE
from fras_log.records import Damaged, read_record
from fras_log.source import Source, open_source

__all__ = [
    "Attached",
    "Began",
    "Broken",
    "Cut",
    "Ended",
    "Event",
    "Progress",
    "Recorded",
    "Told",
    "scan",
]

Progress = Callable[[int, int], None]
"""Told how many bytes are read, of how many."""

MAGIC = b"\x89MCAP0\r\n"
_FOOTER_BYTES = 8 + 8 + 4
_FOOTER_TAIL = struct.Struct("<BQQQ")
_KNOWN = frozenset(int(opcode) for opcode in Opcode)
# A record larger than this is a damaged length.
_MOST_BYTES = 2**31
# Bytes that are tried as pieces, for each byte of the file: chance needs two, a forger all.
_MOST_TRIED = 16
# What stands where a piece begins from which to go on after damage: names with their lengths, in a
# chunk after three numbers of 8 bytes and one of 4, in a record of our own at once.
_PIECE = re.compile(rb"\x04\0\0\0zstd|\x0a\0\0\0fras\.chain|\x0b\0\0\0fras\.closed|\x04\0\0\0fras")
_BEFORE_COMPRESSION = 3 * 8 + 4
_OF_THE_INDEX: dict[int, Any] = {
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.STATISTICS: Statistics,
    Opcode.CHUNK_INDEX: ChunkIndex,
    Opcode.ATTACHMENT_INDEX: AttachmentIndex,
    Opcode.METADATA_INDEX: MetadataIndex,
    Opcode.SUMMARY_OFFSET: SummaryOffset,
}
# What the library raises where bytes are damaged, depending on where that is.
_DAMAGE = (McapError, struct.error, ValueError, IndexError, KeyError, OverflowError, MemoryError)


def scan(path: Path, progress: Progress | None = None) -> Iterator[Event]:
    """Yield what a file holds, in its order.

    Parameters
    ----------
    path : Path
        Opened for reading alone.
    progress : callable, optional
        Called at each record of the file.

    Raises
    ------
    NoSuchLog
        It can't be opened.
    NotAnMcap
        It does not begin as an MCAP file does, and no piece of a log is in it.
    """
    with open_source(path) as source:
        one = _Scan(source, progress)
        position = len(MAGIC)
        if source.read(0, len(MAGIC)) != MAGIC:
            problem = "it does not begin with MCAP's magic bytes"
            position = one.next_piece(1)
            if position < 0:
                raise NotAnMcap(path, problem)
            yield Broken(0, problem)
        yield from one.events(position)


@dataclass(frozen=True, slots=True)
class _Frame:
    offset: int
    opcode: int
    start: int
    end: int

    @property
    def length(self) -> int:
        return self.end - self.offset


class _Scan:
    def __init__(self, source: Source, progress: Progress | None) -> None:
        self._source = source
        self._size = source.size
        self._progress = progress
        self._index = Index()
        self._definitions: dict[int, Definition] = {}
        # Channels that only the index names: where the piece that defined them is lost.
        self._spare: dict[int, Definition] = {}
        self._spare_schemas: dict[int, Schema] = {}
        self._broken = False
        self._data_end: _Frame | None = None
        self._false_ends = 0
        self._tried = 0

    def events(self, position: int) -> Iterator[Event]:
        self._learn_from_summary()
        while position < self._size:
            if self._progress is not None:
                self._progress(position, self._size)
            frame = self._frame(position)
            if isinstance(frame, _Frame) and frame.opcode == Opcode.FOOTER:
                ended, position = yield from self._finish(frame)
                if ended:
                    return
            elif isinstance(frame, _Frame):
                position = yield from self._read(frame)
            else:
                next_position = self.next_piece(position + 1)
                if isinstance(frame, Cut) and next_position >= 0:
                    frame = Broken(frame.offset, "a record here is longer than the file")
                yield self._note(frame)
                if next_position < 0:
                    return
                position = next_position
        yield Cut(self._size, "the file ends without a footer: it was cut, or never closed")

    # --- framing --------------------------------------------------------------------------

    def _frame(self, position: int) -> _Frame | Broken | Cut:
        head = self._source.read(position, position + FRAME.size)
        if len(head) < FRAME.size:
            return Cut(position, f"the file ends within a record, after {self._size} bytes")
        opcode, length = FRAME.unpack(head)
        start = position + FRAME.size
        if opcode not in _KNOWN or length > _MOST_BYTES:
            return Broken(position, f"no record begins here (kind {opcode}, {length} bytes)")
        if start + length > self._size:
            text = f"the file ends within a record of {length} bytes, after {self._size} bytes"
            return Cut(position, text)
        return _Frame(position, opcode, start, start + length)

    def next_piece(self, position: int) -> int:
        """Where the next piece begins that is whole, at `position` or behind; -1 if nowhere."""
        least = max(position, len(MAGIC))
        while (found := self._source.find(_PIECE, position)) >= 0:
            position = found + 1
            for before in (_BEFORE_COMPRESSION, 0):
                offset = found - before - FRAME.size
                frame = self._frame(offset) if offset >= least else None
                if isinstance(frame, _Frame) and self._is_whole(frame):
                    return offset
                if self._tried > _MOST_TRIED * self._size:
                    return -1
        return -1

    def _is_whole(self, frame: _Frame) -> bool:
        if frame.opcode not in (Opcode.CHUNK, Opcode.METADATA):
            return False
        self._tried += frame.length
        try:
            if frame.opcode == Opcode.CHUNK:
                open_chunk(self._content(frame))
            else:
                self._parse(frame, Metadata)
        except _DAMAGE:
            return False
        return True

    def _content(self, frame: _Frame) -> bytes:
        content = self._source.read(frame.start, frame.end)
        if len(content) != frame.end - frame.start:
            raise Damaged("the file was cut while it was read")
        return content

    def _parse(self, frame: _Frame, kind: Any) -> Any:
        return read_record(kind, self._content(frame))

    def _note(self, event: Broken | Cut) -> Broken | Cut:
        self._broken = True
        self._index.lose()
        return event

    # --- records --------------------------------------------------------------------------

    def _read(self, frame: _Frame) -> Generator[Event, None, int]:
        """Yield what a record tells; return where the next one begins."""
        try:
            yield from self._understand(frame)
        except BadChunk as error:
            yield self._note(Broken(frame.offset, str(error)))
            if error.framed:
                return frame.end
        except _DAMAGE as error:
            known = isinstance(error, Damaged)
            why = str(error) if known else f"{type(error).__name__}: {error}"
            yield self._note(Broken(frame.offset, f"a record that can't be read ({why})"))
        else:
            return frame.end
        # Its length may be what is damaged: look for the next piece within it, too.
        following = self.next_piece(frame.offset + 1)
        return following if following >= 0 else frame.end

    def _understand(self, frame: _Frame) -> Iterator[Event]:
        if frame.opcode == Opcode.MESSAGE_INDEX:
            content = self._content(frame)
            if problem := self._index.message_index(frame.offset, frame.length, content):
                raise Damaged(problem)
            return
        if missing := self._index.leave_chunk():
            yield self._note(Broken(frame.offset, missing))
        if self._data_end is not None:
            if frame.opcode not in _OF_THE_INDEX:
                raise Damaged("it stands after the end of the data")
            record = self._parse(frame, _OF_THE_INDEX[frame.opcode])
            self._index.told(frame.offset, frame.length, record)
            return
        match frame.opcode:
            case Opcode.CHUNK:
                yield from self._read_chunk(frame)
            case Opcode.METADATA:
                record = self._parse(frame, Metadata)
                self._index.point(MetadataIndex(frame.offset, frame.length, record.name))
                yield Told(frame.offset, record.name, dict(record.metadata))
            case Opcode.ATTACHMENT:
                yield self._read_attachment(frame)
            case Opcode.DATA_END:
                yield from self._read_data_end(frame)
            case Opcode.HEADER:
                if frame.offset != len(MAGIC):
                    raise Damaged("a header that is not the file's first record")
                yield Began(frame.offset, self._parse(frame, Header).profile)
            case _:
                raise Damaged(f"a record of kind {frame.opcode} where no recorder writes one")

    def _read_chunk(self, frame: _Frame) -> Iterator[Event]:
        # All of it or nothing: a chunk whose checksum is wrong is no evidence.
        chunk = open_chunk(self._content(frame))
        offset, unknown, definitions = frame.offset, 0, self._definitions
        for opcode, number, sequence, log_time, publish_time, payload in chunk.records():
            if opcode == Opcode.MESSAGE:
                channel = definitions.get(number) or self._spare.get(number)
                if channel is None:
                    unknown += 1
                else:
                    yield Recorded(offset, channel, log_time, publish_time, sequence, payload)
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                kind = Schema if opcode == Opcode.SCHEMA else Channel
                try:
                    record = read_record(kind, payload)
                except _DAMAGE as error:
                    record = error.record if isinstance(error, Damaged) else None
                    text = f"a {kind.__name__.lower()} in this chunk can't be read ({error})"
                    if record is None:
                        raise BadChunk(text, framed=True) from error
                    yield self._note(Broken(offset, text, loses=False))
                if problem := self._index.define(record):
                    yield self._note(Broken(offset, problem))
                elif isinstance(record, Channel):
                    known = self._spare_schemas | self._index.schemas
                    definitions[record.id] = definition_of(record, known)
            else:
                yield self._note(Broken(offset, f"a record of kind {opcode} in this chunk"))
        self._index.chunk(offset, frame.length, chunk)
        if unknown:
            text = f"{unknown} messages of this chunk are of keys that an earlier, lost piece named"
            yield self._note(Broken(offset, text))

    def _read_attachment(self, frame: _Frame) -> Event:
        record = self._parse(frame, Attachment)
        content = self._content(frame)
        if content[-4:] != struct.pack("<I", zlib.crc32(content[:-4])):
            return self._note(
                Broken(frame.offset, f"the checksum of attachment {record.name!r} is wrong")
            )
        if record.media_type != MEDIA_TYPE:
            text = f"attachment {record.name!r} is said to be {record.media_type!r}"
            return self._note(Broken(frame.offset, text))
        self._index.attach(frame.offset, frame.length, record)
        return Attached(frame.offset, record.name, record.data)

    def _read_data_end(self, frame: _Frame) -> Iterator[Event]:
        told = self._parse(frame, DataEnd).data_section_crc
        self._data_end = frame
        if told != self._source.checksum(0, frame.offset):
            text = "the checksum over all data is wrong: bytes were changed"
            yield self._note(Broken(frame.offset, text, loses=False))

    # --- the end --------------------------------------------------------------------------

    def _finish(self, frame: _Frame) -> Generator[Event, None, tuple[bool, int]]:
        """Yield what is wrong with the end; return whether it is one, else where to go on."""
        after = self._size - frame.end - len(MAGIC)
        if after > 0 and self._false_ends:
            # Each would have all that is before it read once more.
            problems = [Broken(frame.offset, "a second end of the file")]
        else:
            problems = list(self._problems_of_the_end(frame))
        if after and problems:
            # Not an end, but a record that was made to look like one, or two files.
            following = self.next_piece(frame.offset + 1)
            if following >= 0:
                self._false_ends += 1
                yield self._note(Broken(frame.offset, "an end of the file that is none"))
                return False, following
        if after > 0:
            problems.append(Broken(frame.end, f"{after} bytes follow the end of the log"))
        elif self._source.read(frame.end, self._size) != MAGIC:
            problems.append(Broken(frame.end, "the file does not end with MCAP's magic bytes"))
        for problem in problems:
            yield self._note(problem)
        if not self._broken:
            yield Ended(frame.offset)
        return True, self._size

    def _problems_of_the_end(self, frame: _Frame) -> Iterator[Broken]:
        try:
            footer: Footer = self._parse(frame, Footer)
        except _DAMAGE as error:
            yield Broken(frame.offset, f"the footer can't be read ({type(error).__name__})")
            return
        if self._data_end is None:
            yield Broken(frame.offset, "the data's end is not marked", loses=False)
            return
        if not self._data_end.end == footer.summary_start <= frame.offset:
            yield Broken(frame.offset, "the footer points to no index", loses=False)
            return
        covered = self._source.read(footer.summary_start, frame.offset)
        covered += self._source.read(frame.offset, frame.offset + _FOOTER_TAIL.size)
        if footer.summary_crc != zlib.crc32(covered):
            text = "the checksum over the index is wrong: bytes were changed"
            yield Broken(frame.offset, text, loses=False)
        elif not self._broken:
            yield from self._index.problems(footer.summary_start, footer.summary_offset_start)

    def _learn_from_summary(self) -> None:
        """Take keys from the index at the end, so that a lost first chunk costs only itself."""
        tail = self._size - len(MAGIC) - FRAME.size - _FOOTER_BYTES
        frame = self._frame(tail) if tail > len(MAGIC) else None
        if not isinstance(frame, _Frame) or frame.opcode != Opcode.FOOTER:
            return
        schemas = self._spare_schemas
        try:
            position = self._parse(frame, Footer).summary_start
            while len(MAGIC) < position < tail:
                one = self._frame(position)
                if not isinstance(one, _Frame):
                    return
                if one.opcode == Opcode.SCHEMA:
                    schema = self._parse(one, Schema)
                    schemas[schema.id] = schema
                elif one.opcode == Opcode.CHANNEL:
                    channel = self._parse(one, Channel)
                    self._spare[channel.id] = definition_of(channel, schemas)
                position = one.end
        except _DAMAGE:
            # The scan itself will come here and say so.
            return
