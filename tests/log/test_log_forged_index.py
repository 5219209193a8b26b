"""What the chain does not cover: an index or a record by which another reader sees another log."""

import dataclasses
import struct
from collections.abc import Callable
from typing import Any

import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, MessageIndex, Schema

from fras_log import Verification
from fras_log.chunks import BadChunk, open_chunk
from support.damage import Verify, Whole
from support.forger import (
    ChunkPiece,
    Garbage,
    Groups,
    Piece,
    chunks,
    frames,
    put_together,
    repair_checksums,
    take_apart,
)

MIDDLE = 4


def record(one: Channel | Schema) -> Piece:
    builder = RecordBuilder()
    one.write(builder)
    content = builder.end()
    return Piece(content[0], content[9:])


def only_structure(found: Verification) -> str:
    assert not found.intact
    assert not found.authentic
    assert {one.kind for one in found.findings} == {"structure"}, found.findings
    return found.findings[0].text


def test_an_index_of_no_messages_hides_none(pieces: list[Piece], verify: Verify):
    """A reader that seeks would go by the last one, and find nothing on that key."""
    chunk = chunks(pieces)[MIDDLE]
    number = struct.unpack_from("<H", chunk.messages[0].content)[0]
    chunk.behind.append(MessageIndex(number, []))
    assert "not the index" in only_structure(verify(put_together(pieces)))


def before_the_truth(opcode: Opcode, **lie: Any) -> Callable[[Groups], None]:
    """The index says a thing twice; a reader may take the first."""

    def forge(groups: Groups) -> None:
        record: Any = groups[opcode][0]
        groups[opcode].insert(0, dataclasses.replace(record, **lie))

    return forge


def instead(opcode: Opcode, **lie: Any) -> Callable[[Groups], None]:
    def forge(groups: Groups) -> None:
        record: Any = groups[opcode][0]
        groups[opcode][0] = dataclasses.replace(record, **lie)

    return forge


@pytest.mark.parametrize(
    "forge",
    [
        before_the_truth(Opcode.CHUNK_INDEX, message_start_time=1),
        before_the_truth(Opcode.CHANNEL, topic="mine"),
        before_the_truth(Opcode.SCHEMA, name="mine"),
        before_the_truth(Opcode.STATISTICS, message_count=1),
        before_the_truth(Opcode.ATTACHMENT_INDEX, name="mine"),
        before_the_truth(Opcode.METADATA_INDEX),
        instead(Opcode.ATTACHMENT_INDEX, data_size=1),
        instead(Opcode.ATTACHMENT_INDEX, media_type="text/html"),
        instead(Opcode.ATTACHMENT_INDEX, log_time=1),
    ],
)
def test_a_lie_in_the_index(pieces: list[Piece], verify: Verify, forge: Callable[[Groups], None]):
    assert "the index" in only_structure(verify(put_together(pieces, forge)))


def test_where_each_kind_stands(whole: Whole, verify: Verify):
    """A reader may look for the keys there alone, and find none."""
    forged = bytearray(whole.data)
    told = next(
        one
        for one in frames(whole.data)
        if one.opcode == Opcode.SUMMARY_OFFSET and one.content[0] == Opcode.CHANNEL
    )
    struct.pack_into("<Q", forged, told.end - 8, 0)
    assert "each kind" in only_structure(verify(repair_checksums(bytes(forged))))


def test_what_an_attachment_is_said_to_be(pieces: list[Piece], verify: Verify):
    place = next(i for i, one in enumerate(pieces) if one.opcode == Opcode.ATTACHMENT)
    content = pieces[place].content.replace(
        b"application/octet-stream", b"application/x-executable"
    )
    pieces[place] = Piece(Opcode.ATTACHMENT, content)
    found = verify(put_together(pieces))
    assert "is said to be" in found.findings[0].text


def test_the_places_of_the_groups_are_where_the_footer_says(whole: Whole, verify: Verify):
    (footer,) = [one for one in frames(whole.data) if one.opcode == Opcode.FOOTER]
    forged = bytearray(whole.data)
    struct.pack_into("<Q", forged, footer.offset + 9 + 8, footer.offset - 1)
    assert "the footer" in only_structure(verify(repair_checksums(bytes(forged))))


def test_a_chunk_of_no_messages_tells_no_times(pieces: list[Piece], verify: Verify):
    """The log would last from 1970 on."""
    place = pieces.index(chunks(pieces)[MIDDLE])
    pieces.insert(place, ChunkPiece(Opcode.CHUNK, b"", times=(1, 2)))
    assert "no messages" in only_structure(verify(put_together(pieces)))


@pytest.mark.parametrize(
    "one",
    [
        Channel(id=99, topic="sa/other", message_encoding="msgpack", metadata={}, schema_id=0),
        Schema(id=99, name="mine", encoding="jsonschema", data=b"{}"),
    ],
)
def test_a_definition_that_nothing_is_of(
    pieces: list[Piece], verify: Verify, one: Channel | Schema
):
    """Every viewer would list a key that never was."""
    chunks(pieces)[MIDDLE].inside.append(record(one))
    assert "of no message" in only_structure(verify(put_together(pieces)))


@pytest.mark.parametrize("content", [b"", b"\xff" * 40])
def test_a_definition_that_is_none_costs_its_chunk_alone(
    whole: Whole, pieces: list[Piece], verify: Verify, content: bytes
):
    chunks(pieces)[MIDDLE].inside.insert(0, Garbage(Opcode.CHANNEL, content))
    found = verify(put_together(pieces))
    assert "a channel in this chunk can't be read" in found.findings[0].text
    assert found.messages == len(whole.messages) - len(whole.per_chunk[MIDDLE])


@pytest.mark.parametrize("opcode", [Opcode.CHANNEL, Opcode.SCHEMA])
def test_bytes_behind_a_definition(pieces: list[Piece], verify: Verify, opcode: Opcode):
    inside = chunks(pieces)[0].inside
    place = next(i for i, one in enumerate(inside) if one.opcode == opcode)
    inside[place] = Piece(opcode, inside[place].content + b"more")
    assert "more in it" in only_structure(verify(put_together(pieces)))


def with_entry(content: bytes, at: int, name: bytes, value: bytes) -> bytes:
    """A record with one more entry in the map at its end, which begins at `at`."""
    entry = b"".join(len(part).to_bytes(4, "little") + part for part in (name, value))
    size = len(content) - at - 4 + len(entry)
    return content[:at] + struct.pack("<I", size) + entry + content[at + 4 :]


def test_a_name_said_twice_in_a_record(pieces: list[Piece], verify: Verify):
    """One reader takes the first, another the last: what is signed is not what is shown."""
    place = next(i for i, one in enumerate(pieces) if one.opcode == Opcode.METADATA)
    content = pieces[place].content
    assert content.startswith(b"\x04\0\0\0fras")
    forged = with_entry(content, 8, b"trial", b"another")
    pieces[place] = Piece(Opcode.METADATA, forged)
    assert "said twice" in verify(put_together(pieces)).findings[0].text


def test_a_name_said_twice_of_a_channel(pieces: list[Piece], verify: Verify):
    inside = chunks(pieces)[0].inside
    place = next(i for i, one in enumerate(inside) if one.opcode == Opcode.CHANNEL)
    content = inside[place].content
    at = content.index(b"\x0e\0\0\0zenoh_encoding") - 4
    forged = with_entry(content, at, b"zenoh_encoding", b"text/plain")
    inside[place] = Piece(Opcode.CHANNEL, forged)
    assert "said twice" in verify(put_together(pieces)).findings[0].text


def test_bytes_behind_what_was_compressed(
    whole: Whole, verify: Verify, monkeypatch: pytest.MonkeyPatch
):
    """This reader would stop at the end of the frame; another one reads on."""
    compress = zstandard.compress
    monkeypatch.setattr(zstandard, "compress", lambda data: compress(data) + compress(b"more"))
    found = verify(put_together(take_apart(whole.data)))
    assert "can't be decompressed" in found.findings[0].text


def test_the_size_of_a_chunk_that_is_not_compressed(pieces: list[Piece], verify: Verify):
    """The library goes by that of the data, others by what is said."""
    data = put_together(pieces)
    chunk = chunks(take_apart(data))[MIDDLE]
    body = zstandard.decompress(chunk.content[44:])
    head = bytearray(chunk.content[:28])
    struct.pack_into("<Q", head, 16, len(body) + 1)
    content = bytes(head) + bytes(4) + struct.pack("<Q", len(body)) + body
    with pytest.raises(BadChunk, match="lies about its size"):
        open_chunk(content)
