"""An MCAP file as a stream of raw messages, whole or cut off: the one file that imports mcap."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

import zstandard
from mcap.exceptions import McapError
from mcap.records import Channel, Footer, Header, McapRecord, Message, Metadata
from mcap.stream_reader import CRCValidationError, StreamReader

from fras_log.errors import ForeignLog, NoSuchLog, NotAnMcap
from fras_log.names import CLOSED, METADATA, PROFILE

# What the library raises where the bytes end or are damaged, depending on where that is.
_DAMAGE = (McapError, CRCValidationError, UnicodeDecodeError, struct.error, zstandard.ZstdError)


class RawMessage(NamedTuple):
    """A message as recorded: its key without the cell, its bytes, and when it arrived."""

    key: str
    payload: bytes
    arrival_ns: int


class LogReader:
    """Reads a log once, from front to back, as far as it is intact.

    The library's seeking reader needs the index at the end of the file, which a killed recorder
    never wrote, and sorts by arrival; the stream reader needs neither and keeps the file's order.
    Checksums are verified, so a damaged chunk ends the reading and is not taken for data.

    Parameters
    ----------
    path : Path

    Attributes
    ----------
    metadata : dict of str to str
        The recorder's record `fras`; filled while reading, it stands before any message.
    closing : dict of str to str
        The recorder's last record, `fras.closed`; empty where there is none.
    damage : str
        Why reading ended before the file's footer; empty when all of it was read.
    bytes_read : int
        How far reading has come in the file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.metadata: dict[str, str] = {}
        self.closing: dict[str, str] = {}
        self.damage = "not read yet"
        self.bytes_read = 0

    def messages(self) -> Iterator[RawMessage]:
        """Yield the messages in the order in which they arrived.

        Raises
        ------
        NoSuchLog, NotAnMcap, ForeignLog
        """
        try:
            stream = self.path.open("rb")
        except OSError as error:
            raise NoSuchLog(self.path, error.strerror or str(error)) from error
        with stream:
            yield from self._read(stream)

    def _read(self, stream: BinaryIO) -> Iterator[RawMessage]:
        records = StreamReader(stream, validate_crcs=True).records
        keys: dict[int, str] = {}
        self._read_header(records)
        whole = False
        try:
            for record in records:
                self.bytes_read = stream.tell()
                match record:
                    case Channel(id=number, topic=topic):
                        keys[number] = topic
                    case Metadata(name=name, metadata=content) if name == METADATA:
                        self.metadata = dict(content)
                    case Metadata(name=name, metadata=content) if name == CLOSED:
                        self.closing = dict(content)
                    case Message(channel_id=number, data=data, log_time=arrival_ns) if (
                        number in keys
                    ):
                        yield RawMessage(keys[number], data, arrival_ns)
                    case Footer():
                        whole = True
                    case _:
                        pass
        except _DAMAGE as error:
            self.damage = f"the file ends early or is damaged ({type(error).__name__})"
        else:
            self.damage = "" if whole else "the file has no footer"

    def _read_header(self, records: Iterator[McapRecord]) -> None:
        try:
            header = next(records, None)
        except _DAMAGE as error:
            raise NotAnMcap(self.path, str(error) or "it ends within its header") from error
        if not isinstance(header, Header):
            raise NotAnMcap(self.path, "it does not begin with a header")
        if header.profile != PROFILE:
            raise ForeignLog(self.path, f"its profile is {header.profile!r}, not {PROFILE!r}")
