"""A log as a stream of raw messages, whole or cut off, by MCAP's own stream reader."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

import zstandard
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Footer, Header, McapRecord, Message, Metadata
from mcap.stream_reader import CRCValidationError, StreamReader, get_chunk_data_stream

from fras_log.chunks import MOST_BYTES
from fras_log.errors import ForeignLog, NoSuchLog, NotAnMcap
from fras_log.names import CLOSED, MESSAGES_BEFORE, METADATA, NEXT, PROFILE
from fras_log.parts import parts_of
from fras_log.source import open_regular

# What the library raises where the bytes end or are damaged, depending on where that is.
_DAMAGE = (
    *(McapError, CRCValidationError, struct.error, zstandard.ZstdError),
    *(ValueError, IndexError, KeyError, OverflowError, MemoryError),
)


class RawMessage(NamedTuple):
    """A message as recorded: its key without the cell, its bytes, and when it arrived."""

    key: str
    payload: bytes
    arrival_ns: int


def _records(stream: BinaryIO) -> Iterator[McapRecord]:
    """Yield records, those of chunks too; a chunk that would fill the memory is damage."""
    records = StreamReader(
        stream, emit_chunks=True, validate_crcs=True, record_size_limit=2 * MOST_BYTES
    ).records
    for record in records:
        if not isinstance(record, Chunk):
            yield record
            continue
        size = record.uncompressed_size
        if record.compression == "zstd":
            # The library decompresses as much as the frame itself says.
            size = max(size, zstandard.frame_content_size(record.data))
        if size > MOST_BYTES:
            raise McapError(f"a chunk of {size} bytes")
        yield from _inside(record)


def _inside(chunk: Chunk) -> Iterator[McapRecord]:
    """Yield what a chunk holds; the library makes a list of it, however long."""
    stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    while stream.count < size:
        opcode, length = stream.read1(), stream.read8()
        if opcode == Opcode.MESSAGE:
            yield Message.read(stream, length)
        elif opcode == Opcode.CHANNEL:
            yield Channel.read(stream)
        else:
            stream.read(length)


class LogReader:
    """Reads a log once, from front to back, as far as it is intact.

    The library's seeking reader needs the index at the end of the file, which a killed recorder
    never wrote, and sorts by arrival; the stream reader needs neither and keeps the file's order.
    Checksums are verified, so a damaged chunk ends the reading and is not taken for data.

    Parameters
    ----------
    path : Path
        The log's first file.

    Attributes
    ----------
    files : tuple of Path
        All files of the log.
    metadata : dict of str to str
        The recorder's record `fras`; filled while reading, it stands before any message.
    closing : dict of str to str
        The recorder's last record, `fras.closed`; empty where there is none: that of a file before
        the last one says nothing of the log.
    damage : str
        Why reading ended before the log's end; empty when all of it was read.
    ends : dict of str to str
        Why each file that was read ended, by its name; empty for one that nobody finished.
    file : str
        Name of the file that is read.
    bytes_read : int
        How far reading has come.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.files = parts_of(path)
        self.metadata: dict[str, str] = {}
        self.closing: dict[str, str] = {}
        self.damage = "not read yet"
        self.ends: dict[str, str] = {}
        self.file = ""
        self.bytes_read = 0
        self._messages = 0
        self._torn = False

    @property
    def size(self) -> int:
        """Bytes of all files that are there."""
        return sum(file.stat().st_size for file in self.files if file.is_file())

    def messages(self) -> Iterator[RawMessage]:
        """Yield the messages in the order in which they arrived.

        Raises
        ------
        NoSuchLog, NotAnMcap, ForeignLog
        """
        before = number = 0
        # Looked for anew each time: a log that is still written may grow by a file meanwhile.
        while number < len(parts_of(self.path)):
            self.files = parts_of(self.path)
            file, number = self.files[number], number + 1
            try:
                with open_regular(file) as stream:
                    self.file = file.name
                    for message in self._read(stream, number):
                        self._messages += 1
                        self.bytes_read = before + stream.tell()
                        yield message
                    before += stream.tell()
            except (NoSuchLog, NotAnMcap, ForeignLog) as error:
                if number == 1:
                    raise
                self.damage, self.closing = str(error), {}
                return
            self.ends[file.name] = self.closing.get("reason", "")
            if self._torn:
                self.closing = {}
                return
        if following := self.closing.get(NEXT):
            self.damage, self.closing = f"{following} is missing", {}

    def _read(self, stream: BinaryIO, number: int) -> Iterator[RawMessage]:
        records = _records(stream)
        keys: dict[int, str] = {}
        self._read_header(records, self.files[number - 1])
        self.closing = {}
        whole = False
        try:
            for record in records:
                match record:
                    case Channel(id=channel, topic=topic):
                        keys[channel] = topic
                    case Metadata(name=name, metadata=content) if name == METADATA:
                        self._open(content, number)
                        if self._torn:
                            return
                    case Metadata(name=name, metadata=content) if name == CLOSED:
                        self.closing = dict(content)
                    case Message(channel_id=channel, data=data, log_time=arrival_ns) if (
                        channel in keys
                    ):
                        yield RawMessage(keys[channel], data, arrival_ns)
                    case Footer():
                        whole = True
                    case _:
                        pass
        except _DAMAGE as error:
            self.damage = f"the file ends early or is damaged ({type(error).__name__})"
        else:
            self.damage = "" if whole else "the file has no footer"

    def _open(self, opening: dict[str, str], number: int) -> None:
        """Take what a file says of itself; one that goes on elsewhere ends the reading."""
        if number == 1:
            self.metadata = dict(opening)
        elif opening.get(MESSAGES_BEFORE) == str(self._messages):
            # However the file before it ended: nothing of it is missing.
            self.damage = ""
        else:
            file = self.files[number - 1].name
            before = self.damage or "the files before it are not whole"
            self.damage = f"{before}; {file} goes on after {opening.get(MESSAGES_BEFORE)} messages"
            self._torn = True

    def _read_header(self, records: Iterator[McapRecord], file: Path) -> None:
        try:
            header = next(records, None)
        except _DAMAGE as error:
            raise NotAnMcap(file, str(error) or "it ends within its header") from error
        if not isinstance(header, Header):
            raise NotAnMcap(file, "it does not begin with a header")
        if header.profile != PROFILE:
            raise ForeignLog(file, f"its profile is {header.profile!r}, not {PROFILE!r}")
