"""One chunk of a log: its checksum, and the records in it."""

import struct
import zlib
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field

import zstandard
from mcap.opcode import Opcode

FRAME = struct.Struct("<BQ")
_HEAD = struct.Struct("<QQQII")
_SIZE = struct.Struct("<Q")
_MESSAGE = struct.Struct("<HIQQ")
_ENTRY = struct.Struct("<QQ")
# The recorder's chunks are of 1 MiB and one message; a larger one is a damaged length, or a bomb.
MOST_BYTES = 2**28


class BadChunk(ValueError):
    """A chunk that can't be read.

    Parameters
    ----------
    text : str
    framed : bool
        Whether its two lengths agree, so that the next record begins where it says.
    """

    def __init__(self, text: str, *, framed: bool) -> None:
        super().__init__(text)
        self.framed = framed


@dataclass
class Chunk:
    """A chunk whose checksum is right.

    Parameters
    ----------
    start_time, end_time : int
        What it says of the arrival of its messages [ns].
    compression : str
    compressed_size : int
    data : bytes
        Its records.
    entries : dict of int to bytearray
        Of its messages, by channel: what their index has to be; filled by `records`.
    """

    start_time: int
    end_time: int
    compression: str
    compressed_size: int
    data: bytes
    entries: dict[int, bytearray] = field(default_factory=lambda: defaultdict(bytearray))

    def records(self) -> Iterator[tuple[int, int, int, int, int, bytes]]:
        """Yield opcode, channel, number, times and payload of each record.

        All but messages have no numbers, and their content as payload.

        Raises
        ------
        BadChunk
            Its records are not framed as they should be, or lie about their times.
        """
        data, position, size = self.data, 0, len(self.data)
        first, last = 2**64, 0
        while position < size:
            if size - position < FRAME.size:
                raise BadChunk("the records in this chunk end too early", framed=True)
            opcode, length = FRAME.unpack_from(data, position)
            start = position + FRAME.size
            end = start + length
            if end > size or (opcode == Opcode.MESSAGE and length < _MESSAGE.size):
                raise BadChunk("a record in this chunk is longer than the chunk", framed=True)
            if opcode != Opcode.MESSAGE:
                yield opcode, 0, 0, 0, 0, data[start:end]
            else:
                number, sequence, log_time, publish_time = _MESSAGE.unpack_from(data, start)
                self.entries[number] += _ENTRY.pack(log_time, position)
                if log_time < first:
                    first = log_time
                if log_time > last:
                    last = log_time
                payload = data[start + _MESSAGE.size : end]
                yield opcode, number, sequence, log_time, publish_time, payload
            position = end
        if not self.entries:
            # Its times would count all the same, as those of the log.
            raise BadChunk("there are no messages in this chunk", framed=True)
        if (first, last) != (self.start_time, self.end_time):
            raise BadChunk("this chunk lies about when its messages arrived", framed=True)


def open_chunk(content: bytes) -> Chunk:
    """Decompress a chunk record and hold it against its checksum.

    Raises
    ------
    BadChunk
    """
    try:
        start_time, end_time, size, told, name_length = _HEAD.unpack_from(content)
        name_end = _HEAD.size + min(name_length, 16)
        compression = content[_HEAD.size : name_end].decode("ascii")
        (compressed_size,) = _SIZE.unpack_from(content, name_end)
    except (struct.error, UnicodeDecodeError) as error:
        raise BadChunk(f"a chunk that can't be read ({error})", framed=False) from error
    body = memoryview(content)[name_end + _SIZE.size :]
    framed = len(body) == compressed_size
    if not framed:
        raise BadChunk("the lengths of this chunk contradict each other", framed=False)
    data = _decompress(body, compression, size)
    if zlib.crc32(data) != told:
        raise BadChunk("the checksum of this chunk is wrong: bytes were changed", framed=True)
    return Chunk(start_time, end_time, compression, compressed_size, data)


def _decompress(body: memoryview, compression: str, size: int) -> bytes:
    if compression == "":
        if len(body) != size:
            raise BadChunk("this chunk lies about its size", framed=True)
        return bytes(body)
    if compression != "zstd":
        text = f"a chunk compressed with {compression!r}, which no recorder does"
        raise BadChunk(text, framed=True)
    try:
        # The content's own size first: a damaged one would take all memory.
        if zstandard.frame_content_size(body) != size or size > MOST_BYTES:
            raise BadChunk("this chunk lies about its size", framed=True)
        # Bytes behind the frame would be none to this reader, and some to others.
        return zstandard.ZstdDecompressor().decompress(body, allow_extra_data=False)
    except (zstandard.ZstdError, MemoryError) as error:
        raise BadChunk(f"this chunk can't be decompressed: {error}", framed=True) from error
