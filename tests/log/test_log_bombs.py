"""Logs made to take all memory or time: read to their damage, and no further."""

import io
import resource
import struct
import tracemalloc
import zlib
from pathlib import Path
from typing import Any

import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Channel, DataEnd, Footer, Header, Metadata
from mcap.records import Chunk as ChunkRecord

from fras_common.bus import RawSample
from fras_log import LogFile, LogReader, custody, scan_log, verify_file, writer
from fras_log.chunks import MOST_BYTES
from fras_log.errors import NotAManifest
from fras_log.events import Broken
from fras_log.parts import MOST_PARTS, Manifest, parts_of, read_manifest
from fras_log.scan import MAGIC
from fras_log.source import Source

HELD_BYTES = 64 * 2**20


@pytest.fixture
def bomb(tmp_path: Path) -> Path:
    """A log of some kilobytes whose one chunk says that it is 4 GiB of zeros."""
    compressor = zstandard.ZstdCompressor(level=1)
    sink = io.BytesIO()
    size = 16 * MOST_BYTES
    with compressor.stream_writer(sink, size=size, closefd=False) as writer:
        for _ in range(size // HELD_BYTES):
            writer.write(bytes(HELD_BYTES))
    builder = RecordBuilder()
    Header(profile="fras", library="").write(builder)
    ChunkRecord(
        message_start_time=0,
        message_end_time=0,
        uncompressed_size=size,
        uncompressed_crc=0,
        compression="zstd",
        data=sink.getvalue(),
    ).write(builder)
    path = tmp_path / "audit.mcap"
    path.write_bytes(MAGIC + builder.end())
    return path


def record(*records: Any) -> bytes:
    builder = RecordBuilder()
    for one in records:
        one.write(builder)
    return builder.end()


HEAD = MAGIC + record(Header(profile="fras", library=""))


def framed(opcode: Opcode, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


def chunk_of(messages: int) -> bytes:
    """A chunk of empty messages: 31 bytes each, and next to nothing once it is compressed."""
    channel = Channel(id=1, topic="a", message_encoding="", metadata={}, schema_id=0)
    data = record(channel) + messages * framed(Opcode.MESSAGE, struct.pack("<HIQQ", 1, 0, 0, 0))
    return record(
        ChunkRecord(
            message_start_time=0,
            message_end_time=0,
            uncompressed_size=len(data),
            uncompressed_crc=zlib.crc32(data),
            compression="zstd",
            data=zstandard.compress(data),
        )
    )


@pytest.fixture
def bytes_read(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many bytes each read of a file gave."""
    found: list[int] = []
    read = Source.read

    def count(self: Source, start: int, end: int) -> bytes:
        data = read(self, start, end)
        found.append(len(data))
        return data

    monkeypatch.setattr(Source, "read", count)
    return found


def peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def test_a_chunk_that_is_a_bomb_is_damage_to_every_reader(bomb: Path) -> None:
    assert bomb.stat().st_size < 2**20
    before = peak_bytes()
    events = list(scan_log(bomb))
    assert any("lies about its size" in one.text for one in events if isinstance(one, Broken))
    reader = LogReader(bomb)
    assert list(reader.messages()) == []
    assert "McapError" in reader.damage
    assert peak_bytes() - before < MOST_BYTES


def test_a_length_beyond_all_memory_is_damage(tmp_path: Path) -> None:
    builder = RecordBuilder()
    Header(profile="fras", library="").write(builder)
    head = MAGIC + builder.end()
    for opcode in (Opcode.ATTACHMENT, Opcode.CHUNK, Opcode.METADATA):
        for length in (2**63, 2**63 - 1, 2**40, MOST_BYTES + 1):
            path = tmp_path / "audit.mcap"
            path.write_bytes(head + bytes([opcode]) + length.to_bytes(8, "little") + bytes(99))
            list(scan_log(path))
            reader = LogReader(path)
            assert list(reader.messages()) == []
            assert reader.damage


def test_an_attachment_whose_data_are_said_to_be_endless_is_damage(tmp_path: Path) -> None:
    builder = RecordBuilder()
    Header(profile="fras", library="").write(builder)
    head = MAGIC + builder.end()
    content = (
        bytes(16) + (1).to_bytes(4, "little") + b"a" + bytes(4) + (2**62).to_bytes(8, "little")
    )
    content += zlib.crc32(content).to_bytes(4, "little")
    record = bytes([Opcode.ATTACHMENT]) + len(content).to_bytes(8, "little") + content
    path = tmp_path / "audit.mcap"
    path.write_bytes(head + record)
    reader = LogReader(path)
    assert list(reader.messages()) == []
    assert reader.damage


def test_a_part_of_an_impossible_number_is_none(tmp_path: Path) -> None:
    path = tmp_path / "audit.mcap"
    for name in ("audit.mcap", "audit.3.mcap", f"audit.{MOST_PARTS + 1}.mcap", "audit.9{}.mcap"):
        (tmp_path / name.format("9" * 30)).touch()
    assert len(parts_of(path)) == 3


@pytest.mark.parametrize(
    "content",
    [b"[" * 100_000, b'{"trial":"\xff"}', b'{"a":' * 100_000, b"{}", b" " * (5 * 2**20)],
    ids=["nested", "no text", "maps", "empty", "long"],
)
def test_a_manifest_that_is_none_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "audit.manifest.json"
    path.write_bytes(content)
    with pytest.raises(NotAManifest):
        read_manifest(path)


def test_messages_without_end_and_no_checkpoint_are_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(custody, "MOST_OF_A_STRETCH", 100)
    path = tmp_path / "audit.mcap"
    path.write_bytes(HEAD + record(Metadata(name="fras", metadata={})) + chunk_of(1000))
    found = verify_file(path)
    assert found.messages == 1000
    assert found.chained == 0
    assert any("without a checkpoint" in one.text for one in found.findings)


def test_a_chunk_is_read_one_message_at_a_time(tmp_path: Path) -> None:
    path = tmp_path / "audit.mcap"
    path.write_bytes(HEAD + chunk_of(20_000))
    messages = LogReader(path).messages()
    next(messages)
    tracemalloc.start()
    try:
        assert sum(1 for _ in messages) == 19_999
        # A list of them would take four times as much.
        assert tracemalloc.get_traced_memory()[1] < 20_000 * 50
    finally:
        tracemalloc.stop()


def test_empty_messages_fill_a_chunk_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writer, "CHUNK_BYTES", 64 * 100)
    path = tmp_path / "audit.mcap"
    log = LogFile(path, {}, {}, 0)
    for number in range(1000):
        log.write(RawSample("someone/else", b"", ""), number)
    log.close({})
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert len(summary.chunk_indexes) == 10


def test_ends_without_end_are_read_once(tmp_path: Path, bytes_read: list[int]) -> None:
    """Each of them says that all before it is the index."""
    path = tmp_path / "audit.mcap"
    head = HEAD + record(DataEnd(0))
    end = record(Footer(len(head), 0, 1), Metadata(name="fras", metadata={}))
    path.write_bytes(head + 300 * end)
    assert len(list(scan_log(path))) > 300
    assert sum(bytes_read) < 2 * 300 * 4096 + 20 * path.stat().st_size


def test_pieces_within_pieces_are_not_all_tried(tmp_path: Path, bytes_read: list[int]) -> None:
    """Each is as long as the rest of the file, and its checksum wrong."""
    path = tmp_path / "audit.mcap"
    inner = bytes(2**16)
    for _ in range(300):
        head = struct.pack("<QQQII", 0, 0, len(inner), 1, 4) + b"zstd"
        inner = framed(Opcode.CHUNK, head + struct.pack("<Q", len(inner)) + inner)
    path.write_bytes(HEAD + b"\xff" + inner)
    assert any(isinstance(one, Broken) for one in scan_log(path))
    assert sum(bytes_read) < 40 * path.stat().st_size


def test_a_manifest_is_not_written_through_a_link(tmp_path: Path) -> None:
    precious = tmp_path / "precious"
    precious.write_bytes(b"precious")
    path = tmp_path / "audit.manifest.json"
    path.with_name(path.name + ".new").symlink_to(precious)
    Manifest(trial="t-1", parts=()).save(path)
    assert precious.read_bytes() == b"precious"
    assert read_manifest(path) == Manifest(trial="t-1", parts=())
