"""One record of a log, read strictly: each byte of it says something, and says it once."""

from io import BytesIO
from typing import Any

from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.records import Channel, ChunkIndex, Metadata, Statistics

from fras_log.chunks import FRAME

# Where a name may stand twice; of the others each byte counts.
_WITH_MAPS = frozenset({Channel, ChunkIndex, Metadata, Statistics})


class Damaged(ValueError):
    """A record that is not what it should be.

    Attributes
    ----------
    record
        What can be read of it all the same; None if nothing can.
    """

    def __init__(self, text: str, record: Any = None) -> None:
        super().__init__(text)
        self.record = record


def read_record(kind: Any, content: bytes) -> Any:
    """Read a record as the library does, and hold it against what the library would write.

    Readers differ in what they make of a name that stands twice in a map; the chain is over what
    one of them saw.

    Raises
    ------
    Damaged
        There are bytes behind it, or in it that do not count.
    """
    stream = ReadDataStream(BytesIO(content))
    record = kind.read(stream)
    if stream.count != len(content):
        raise Damaged("there is more in it than belongs there", record)
    if kind in _WITH_MAPS:
        builder = RecordBuilder()
        record.write(builder)
        if builder.end()[FRAME.size :] != content:
            raise Damaged("something is said twice in it, or not as a recorder says it", record)
    return record
