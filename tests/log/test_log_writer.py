"""The audit log: verbatim, complete, readable by the stock reader even while it is written."""

import io
import json
import shutil
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgpack
import pytest
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, DataEnd, Message, Schema
from mcap.stream_reader import StreamReader

from fras_common.bus import RawSample
from fras_common.codec import encode, json_schema, read_header
from fras_common.messages import Header, LogRecord, RobotState
from fras_common.topics import LOG
from fras_log import LogExists, LogFile

ENCODING = "application/msgpack"
Opened = Callable[..., LogFile]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "run" / "audit.mcap"


@pytest.fixture
def opened(path: Path) -> Iterator[Opened]:
    files: list[LogFile] = []

    def open_log(**contents: Any) -> LogFile:
        files.append(
            LogFile(path, contents.get("metadata", {}), contents.get("attachments", {}), 1_000)
        )
        return files[-1]

    yield open_log
    for file in files:
        file.abandon()


def log_sample(seq: int, source: str = "sim/1", key: str = "log/sim", stamp: int = 77) -> RawSample:
    message = LogRecord(
        stamp_ns=stamp, seq=seq, source=source, trial="t-1", tick=seq, level="warning",
        event=f"event {seq}", fields={},
    )  # fmt: skip
    return RawSample(key, encode(message), ENCODING)


def read(path: Path) -> list[tuple[Schema | None, Channel, Message]]:
    with path.open("rb") as stream:
        return list(make_reader(stream, validate_crcs=True).iter_messages(log_time_order=False))


def test_samples_come_back_verbatim(path: Path, opened: Opened):
    file = opened()
    samples = [log_sample(seq, stamp=100 + seq) for seq in range(50)]
    for number, sample in enumerate(samples):
        file.write(sample, arrival_ns=1_000 + number)
    file.close({})
    got = read(path)
    assert [message.data for _, _, message in got] == [sample.payload for sample in samples]
    assert [message.publish_time for _, _, message in got] == [100 + seq for seq in range(50)]
    assert [message.log_time for _, _, message in got] == [1_000 + n for n in range(50)]
    assert [message.sequence for _, _, message in got] == list(range(50))
    assert file.messages == 50
    assert file.lost == 0
    assert file.bytes_written == path.stat().st_size


def test_the_stock_reader_finds_encoding_schema_and_topic(path: Path, opened: Opened):
    file = opened()
    file.write(log_sample(0), 1)
    file.write(log_sample(0, source="sa/1", key="log/sa"), 2)
    file.close({})
    found = {channel.topic: (schema, channel) for schema, channel, _ in read(path)}
    assert set(found) == {"log/sim", "log/sa"}
    schema, channel = found["log/sim"]
    assert schema is not None
    assert (schema.name, schema.encoding) == ("fras.LogRecord", "jsonschema")
    assert json.loads(schema.data) == json_schema(LOG.type)
    assert channel.message_encoding == "msgpack"
    assert channel.metadata == {"zenoh_encoding": ENCODING}
    assert found["log/sa"][0] == schema
    payload = next(message for _, _, message in read(path)).data
    assert msgpack.unpackb(payload)["event"] == "event 0"


def test_the_file_says_what_it_is(path: Path, opened: Opened):
    file = opened(metadata={"trial": "t-1"}, attachments={"scenario.toml": b"seed = 1"})
    file.write(log_sample(0), 1)
    file.close({"messages": "1"})
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert reader.get_header().profile == "fras"
        records = {record.name: record.metadata for record in reader.iter_metadata()}
        assert set(records) == {"fras", "fras.chain", "fras.closed"}
        assert records["fras"] == {"trial": "t-1"}
        assert records["fras.closed"] == {"messages": "1", "head": file.head, "signature": ""}
        (attachment,) = reader.iter_attachments()
        assert (attachment.name, attachment.data) == ("scenario.toml", b"seed = 1")
        summary = reader.get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == 1


def test_gaps_are_counted_by_key_and_source(path: Path, opened: Opened):
    file = opened()
    for seq in (5, 6, 9):
        file.write(log_sample(seq), 1)
    file.write(log_sample(0, source="sim/2"), 1)
    file.write(log_sample(0, key="log/sa"), 1)
    file.write(log_sample(3, key="log/sa"), 1)
    assert file.lost == 4
    assert file.messages == 6


def test_a_copy_is_not_written_twice(path: Path, opened: Opened):
    file = opened()
    for seq in (0, 1, 2, 1, 0, 2, 3):
        header = file.write(log_sample(seq), 1)
        assert header is not None
        assert header.seq == seq
    file.close({})
    assert [message.sequence for _, _, message in read(path)] == [0, 1, 2, 3]
    assert (file.messages, file.lost) == (4, 0)


def test_a_forged_number_leaves_nothing_out(path: Path, opened: Opened):
    """Only a copy, number and stamp, is left out; a gap is told, what follows is recorded."""
    file = opened()
    for seq, stamp in ((0, 10), (2**32 - 1, 11), (1, 12), (2, 13), (1, 12)):
        file.write(log_sample(seq, stamp=stamp), 1)
    file.close({})
    assert [message.sequence for _, _, message in read(path)] == [0, 2**32 - 1, 1, 2]
    assert file.lost == 2**32 - 2


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"no message",
        b"\x80",
        msgpack.packb({"value": 1}),
        msgpack.packb([1, 2]),
        encode(Header(stamp_ns=-1, source="sim/1")),
        encode(Header(seq=-1, source="sim/1")),
        encode(Header(seq=2**32, source="sim/1")),
        b"\x81\xa7request" + b"\x91" * 100_000,
        b"\x81\xa6source\xa1\xff",
    ],
    ids=lambda payload: payload[:10].hex() or "nothing",
)
def test_what_has_no_header_is_recorded_all_the_same(path: Path, opened: Opened, payload: bytes):
    file = opened()
    assert read_header(payload) is None
    for number in range(3):
        assert file.write(RawSample("unheard/of", payload, "text/plain"), 500 + number) is None
    file.close({})
    got = read(path)
    assert [(message.data, message.publish_time) for _, _, message in got] == [
        (payload, 500 + number) for number in range(3)
    ]
    schema, channel, _ = got[0]
    assert schema is None
    assert (channel.topic, channel.metadata["zenoh_encoding"]) == ("unheard/of", "text/plain")


def test_extreme_headers_fit():
    header = read_header(encode(Header(stamp_ns=2**64 - 1, seq=2**32 - 1, source="s", trial="t")))
    assert header is not None
    assert (header.stamp_ns, header.seq, header.source) == (2**64 - 1, 2**32 - 1, "s")


def test_a_header_is_read_whatever_follows_it():
    state = RobotState(tick=4, seq=9, source="motion/1", arms={}, action=None, holds={},
                       verdict_tick=3)  # fmt: skip
    header = read_header(encode(state))
    assert header is not None
    assert (header.tick, header.seq, header.trial) == (4, 9, "")


def test_a_log_is_never_written_over(path: Path, opened: Opened):
    file = opened()
    file.write(log_sample(0), 1)
    file.close({})
    before = path.read_bytes()
    with pytest.raises(LogExists, match="never written over") as caught:
        LogFile(path, {}, {}, 0)
    assert caught.value.values == {"path": path}
    assert path.read_bytes() == before


def test_what_was_flushed_is_readable_while_the_file_is_open(
    path: Path, opened: Opened, tmp_path: Path
):
    file = opened(metadata={"trial": "t-1"})
    for seq in range(10):
        file.write(log_sample(seq), seq)
    file.flush()
    for seq in range(10, 20):
        file.write(log_sample(seq), seq)
    copy = tmp_path / "copy.mcap"
    shutil.copy(path, copy)
    assert file.bytes_written == copy.stat().st_size
    assert [message.sequence for message in streamed(copy)] == list(range(10))
    file.close({})
    assert [message.sequence for _, _, message in read(path)] == list(range(20))


def streamed(path: Path) -> list[Message]:
    """Messages of a file without an end, as far as they go."""
    messages: list[Message] = []
    with path.open("rb") as stream:
        try:
            for record in StreamReader(stream, validate_crcs=True).records:
                if isinstance(record, Message):
                    messages.append(record)
        except (McapError, struct.error):
            # Where the file ends, as it must: its footer is not written yet.
            return messages
    raise AssertionError("the file is complete")


def test_the_beginning_is_readable_before_the_first_message(path: Path, opened: Opened):
    opened(metadata={"trial": "t-1"}, attachments={"scenario.toml": b"seed = 1"})
    assert b"scenario.toml" in path.read_bytes()
    assert b"t-1" in path.read_bytes()


def test_a_flush_without_news_writes_nothing(path: Path, opened: Opened):
    file = opened()
    file.write(log_sample(0), 1)
    file.flush()
    size = path.stat().st_size
    file.flush()
    assert path.stat().st_size == size == file.bytes_written


def test_damage_is_noticed(path: Path, opened: Opened):
    file = opened()
    for seq in range(20):
        file.write(log_sample(seq), seq)
    file.close({})
    whole = path.read_bytes()
    chunks, ends = [], []
    for record in StreamReader(io.BytesIO(whole), emit_chunks=True).records:
        chunks += [record] if isinstance(record, Chunk) else []
        ends += [record] if isinstance(record, DataEnd) else []
    assert all(chunk.uncompressed_crc for chunk in chunks)
    assert [bool(end.data_section_crc) for end in ends] == [True]
    damaged = bytearray(whole)
    damaged[whole.index(chunks[0].data) + len(chunks[0].data) // 2] ^= 0x40
    path.write_bytes(damaged)
    with pytest.raises(Exception, match=r"(?i)crc|zstd|decompress|corrupt"):
        read(path)


def test_large_samples_are_chunked_and_complete(path: Path, opened: Opened):
    file = opened()
    for seq in range(40):
        message = LogRecord(seq=seq, source="sim/1", level="", event="x" * 80_000, fields={})
        file.write(RawSample("log/sim", encode(message), ENCODING), seq)
    file.close({})
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert len(summary.chunk_indexes) > 1
    assert len(read(path)) == 40


def test_an_abandoned_file_keeps_what_was_flushed(path: Path, opened: Opened):
    file = opened()
    file.write(log_sample(0), 1)
    file.flush()
    file.write(log_sample(1), 2)
    file.abandon()
    file.abandon()
    assert [message.sequence for message in streamed(path)] == [0]
