"""A log that someone changed, every checksum repaired: the message is named, or the record."""

import dataclasses
import itertools
import struct
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from mcap.opcode import Opcode
from mcap.records import Attachment, Metadata

from fras_common.codec import decode, encode
from fras_common.messages import Verdict
from fras_log import Finding, Signer, Verification, verify_file
from fras_log.chain import Chain, Checkpoint, first_head, leaf
from fras_log.scan import Recorded, scan
from support.damage import Message, Verify, Whole, write_log
from support.forger import (
    MAGIC,
    ChunkPiece,
    Piece,
    attachment,
    chunks,
    frames,
    message,
    metadata,
    put_together,
    read,
    repair_checksums,
)

MIDDLE = 4


def at(whole: Whole, chunk: int, number: int) -> Message:
    return whole.per_chunk[chunk][number]


def place_of(pieces: list[Piece], chunk: int, number: int) -> int:
    """Index among all records of a chunk, schemas and channels too."""
    one = chunks(pieces)[chunk]
    return [i for i, piece in enumerate(one.inside) if piece.opcode == Opcode.MESSAGE][number]


def only_chain(found: Verification) -> Finding:
    assert not found.intact
    assert not found.authentic
    assert {one.kind for one in found.findings} == {"chain"}, found.findings
    return found.findings[0]


def assert_names(finding: Finding, message: Message) -> None:
    assert (finding.topic, finding.sequence) == (message.topic, message.sequence)
    assert finding.tick == tick_of(message)
    assert finding.offset > 0


def verdicts(whole: Whole) -> list[int]:
    """Which messages of the piece in the middle they are."""
    return [i for i, one in enumerate(whole.per_chunk[MIDDLE]) if one.topic == "sa/verdict"]


def edit_force(pieces: list[Piece], number: int) -> None:
    """Change one force value of a verdict of the piece in the middle."""
    inside, place = chunks(pieces)[MIDDLE].inside, place_of(pieces, MIDDLE, number)
    told = decode(Verdict, inside[place].content[22:], "sa/verdict")
    edited = encode(msgspec.structs.replace(told, max_force_n=0.499))
    assert len(edited) == len(inside[place].content) - 22
    inside[place] = message(inside[place], edited)


def tick_of(message: Message) -> int:
    return msgspec.msgpack.decode(message.payload)["tick"]


def test_the_log_itself_is_authentic_and_so_is_what_the_forger_puts_together(
    whole: Whole, pieces: list[Piece], verify: Verify, signer: Signer
):
    assert put_together(pieces) == whole.data
    found = verify(whole.data)
    assert found.authentic, found.findings
    assert found.signed_by == signer.public.fingerprint
    assert found.messages == found.chained == len(whole.messages)


def test_a_force_that_was_edited_is_named(whole: Whole, pieces: list[Piece], verify: Verify):
    number = verdicts(whole)[0]
    edit_force(pieces, number)
    found = verify(put_together(pieces))
    finding = only_chain(found)
    assert_names(finding, at(whole, MIDDLE, number))
    assert finding.text == "this message was changed"
    assert len(found.findings) == 1
    assert found.chained == sum(map(len, whole.per_chunk[:MIDDLE]))
    assert not found.signed_by


def test_each_of_several_edited_ones_is_named(whole: Whole, pieces: list[Piece], verify: Verify):
    chosen = verdicts(whole)[1:4]
    for number in chosen:
        edit_force(pieces, number)
    found = verify(put_together(pieces))
    only_chain(found)
    for finding, number in zip(found.findings, chosen, strict=True):
        assert_names(finding, at(whole, MIDDLE, number))


@pytest.mark.parametrize("field", ["sequence", "log_time", "publish_time", "channel"])
def test_what_stands_before_the_payload_counts(
    whole: Whole, pieces: list[Piece], verify: Verify, field: str
):
    inside, place = chunks(pieces)[MIDDLE].inside, place_of(pieces, MIDDLE, 3)
    content = bytearray(inside[place].content)
    content[{"channel": 0, "sequence": 2, "log_time": 6, "publish_time": 14}[field]] ^= 2
    inside[place] = Piece(Opcode.MESSAGE, bytes(content))
    findings = verify(put_together(pieces)).findings
    (finding,) = [one for one in findings if one.kind == "chain"]
    assert finding.text == "this message was changed"
    assert finding.tick == tick_of(at(whole, MIDDLE, 3))


@pytest.mark.parametrize(
    ("part", "old", "new"),
    [
        (Opcode.CHANNEL, b"sa/verdict", b"sa/verdikt"),
        (Opcode.CHANNEL, b"application/msgpack", b"application/msgpakk"),
        (Opcode.SCHEMA, b'"limit_n"', b'"limit_m"'),
    ],
)
def test_what_is_said_of_a_channel_counts(
    pieces: list[Piece], verify: Verify, part: Opcode, old: bytes, new: bytes
):
    """Topic, encoding and schema stand beside the messages; the stock reader goes by them."""
    inside = chunks(pieces)[0].inside
    for index, piece in enumerate(inside):
        if piece.opcode == part:
            inside[index] = Piece(part, piece.content.replace(old, new))
    found = verify(put_together(pieces))
    assert not found.intact
    assert any("changed" in one.text and one.kind == "chain" for one in found.findings)


def test_reordered(whole: Whole, pieces: list[Piece], verify: Verify):
    inside, place = chunks(pieces)[MIDDLE].inside, place_of(pieces, MIDDLE, 5)
    inside[place], inside[place + 1] = inside[place + 1], inside[place]
    finding = only_chain(verify(put_together(pieces)))
    assert "another order" in finding.text
    assert_names(finding, at(whole, MIDDLE, 6))


def test_dropped(whole: Whole, pieces: list[Piece], verify: Verify):
    inside, place = chunks(pieces)[MIDDLE].inside, place_of(pieces, MIDDLE, 5)
    del inside[place : place + 2]
    found = verify(put_together(pieces))
    finding = next(one for one in found.findings if one.kind == "chain")
    assert finding.text.startswith("2 messages before this one are missing")
    assert_names(finding, at(whole, MIDDLE, 7))
    kinds = {one.kind for one in found.findings}
    assert kinds <= {"chain", "sequence", "interlock"}
    # Numbers tell of those whose key goes on.
    assert "sequence" in kinds


def test_the_last_ones_of_a_piece_dropped(pieces: list[Piece], verify: Verify):
    del chunks(pieces)[MIDDLE].inside[-3:]
    found = verify(put_together(pieces))
    assert any("the last ones are missing" in one.text for one in found.findings)


def test_a_whole_piece_dropped(whole: Whole, pieces: list[Piece], verify: Verify):
    """Chunk and checkpoint: the next head does not follow on the one before."""
    index = pieces.index(chunks(pieces)[MIDDLE])
    del pieces[index : index + 2]
    found = verify(put_together(pieces))
    finding = next(one for one in found.findings if one.kind == "chain")
    assert "their count or this checkpoint" in finding.text
    assert found.chained == sum(map(len, whole.per_chunk[:MIDDLE]))


def test_the_end_dropped_and_closed_anew(pieces: list[Piece], verify: Verify):
    """The messages that are left are all vouched for; the closing record is not theirs."""
    last = pieces.index(chunks(pieces)[-1])
    del pieces[last : last + 2]
    found = verify(put_together(pieces))
    assert found.chained == found.messages
    assert any("closing record" in one.text for one in found.findings)
    assert not found.intact


def test_duplicated(whole: Whole, pieces: list[Piece], verify: Verify):
    inside, place = chunks(pieces)[MIDDLE].inside, place_of(pieces, MIDDLE, 5)
    inside.insert(place + 1, inside[place])
    finding = only_chain(verify(put_together(pieces)))
    assert "a copy of an earlier one" in finding.text
    assert_names(finding, at(whole, MIDDLE, 5))


def test_inserted(whole: Whole, pieces: list[Piece], verify: Verify):
    inside, place = chunks(pieces)[MIDDLE].inside, place_of(pieces, MIDDLE, 5)
    payload = inside[place].content[22:]
    inside.insert(place, message(inside[place], payload.replace(b"t-1", b"t-0")))
    finding = only_chain(verify(put_together(pieces)))
    assert "was put in" in finding.text
    assert_names(finding, at(whole, MIDDLE, 5))


def test_moved_to_another_piece(pieces: list[Piece], verify: Verify):
    moved = chunks(pieces)[MIDDLE].inside.pop()
    chunks(pieces)[MIDDLE + 1].inside.insert(0, moved)
    found = verify(put_together(pieces))
    texts = [one.text for one in found.findings if one.kind == "chain"]
    assert "the last ones are missing" in texts[0]
    assert "was put in" in texts[1]


# --- who vouches ------------------------------------------------------------------------------


@pytest.mark.parametrize("signed", [True, False], ids=["with another key", "unsigned"])
def test_a_chain_made_anew_without_the_key_is_not_authentic(
    tmp_path: Path, signer: Signer, signed: bool
):
    """All of it fits together: only the key, or the head that was noted, tells."""
    path = tmp_path / "made.mcap"
    forger = Signer(Ed25519PrivateKey.generate()) if signed else None
    file = write_log(path, forger)
    found = verify_file(path, [signer.public])
    assert found.intact, found.findings
    assert not found.authentic
    assert found.signed_by == (forger.public.fingerprint if forger else "")
    assert verify_file(path, [signer.public], head=file.head).intact
    noted = verify_file(path, [signer.public], head="ab" * 32)
    assert [one.kind for one in noted.findings] == ["chain"]
    assert "not the one that was noted" in noted.findings[0].text


def replace_metadata(
    pieces: list[Piece], name: str, change: Callable[[dict[str, str]], dict[str, str]], nth: int = 0
) -> None:
    found = [
        index
        for index, piece in enumerate(pieces)
        if piece.opcode == Opcode.METADATA and read(piece).name == name
    ]
    record = read(pieces[found[nth]])
    assert isinstance(record, Metadata)
    pieces[found[nth]] = metadata(name, change(dict(record.metadata)))


def test_another_key_in_the_opening_record(pieces: list[Piece], verify: Verify):
    other = Signer(Ed25519PrivateKey.generate()).public.raw.hex()
    replace_metadata(pieces, "fras", lambda told: told | {"public_key": other})
    found = verify(put_together(pieces))
    assert {one.kind for one in found.findings} == {"signature", "chain"}
    assert not found.signed_by


@pytest.mark.parametrize("raw", ["", "zz", "ab"])
def test_no_key_in_the_opening_record(pieces: list[Piece], verify: Verify, raw: str):
    replace_metadata(pieces, "fras", lambda told: told | {"public_key": raw})
    found = verify(put_together(pieces))
    assert not found.intact
    assert not found.signed_by


@pytest.mark.parametrize(
    "content",
    [
        {"reason": "stopped"},
        {"messages": "193"},
        {"head": "00" * 32},
        {"signature": ""},
        {"signature": "zz"},
        {"more": "said"},
    ],
)
def test_a_forged_closing_record(pieces: list[Piece], verify: Verify, content: dict[str, str]):
    replace_metadata(pieces, "fras.closed", lambda told: told | content)
    found = verify(put_together(pieces))
    assert "signature" in {one.kind for one in found.findings}
    assert all(one.offset > 0 for one in found.findings)
    assert not found.intact


def test_no_closing_record(pieces: list[Piece], verify: Verify):
    assert read(pieces.pop()).name == "fras.closed"
    found = verify(put_together(pieces))
    assert [one.text for one in found.findings] == ["the closing record is missing"]
    assert not found.closed


@pytest.mark.parametrize("field", ["head", "messages", "leaves", "signature", "more"])
def test_a_forged_checkpoint(pieces: list[Piece], verify: Verify, field: str):
    def forge(told: dict[str, str]) -> dict[str, str]:
        real = Checkpoint.of_metadata(told)
        forged = {
            "head": dataclasses.replace(real, head=bytes(32)),
            "messages": dataclasses.replace(real, messages=real.messages - 1),
            "leaves": dataclasses.replace(real, leaves=(bytes(8), *real.leaves[1:])),
            "signature": dataclasses.replace(real, signature=bytes(64)),
        }
        return forged[field].as_metadata() if field in forged else told | {"more": "said"}

    place = [one for one in pieces if one.opcode == Opcode.METADATA][MIDDLE + 1]
    replace_metadata(pieces, "fras.chain", forge, MIDDLE)
    found = verify(put_together(pieces))
    assert not found.intact
    assert found.findings, field
    expected = {"head": "signature", "messages": "signature", "leaves": "chain",
                "signature": "signature", "more": "structure"}[field]  # fmt: skip
    assert found.findings[0].kind == expected
    assert found.findings[0].offset == place.offset
    # What comes behind it is not blamed.
    assert len(found.findings) <= 2, found.findings


def test_a_message_and_its_checkpoint_forged(
    whole: Whole, pieces: list[Piece], verify: Verify, tmp_path: Path
):
    """Leaf and head are made to fit, with all heads behind: only the key could sign them."""
    number = verdicts(whole)[0]
    edit_force(pieces, number)
    edited = tmp_path / "edited.mcap"
    edited.write_bytes(put_together(pieces))
    assert_names(verify_file(edited).findings[0], at(whole, MIDDLE, number))
    chain = Chain(first_head(*beginning(pieces)))
    recorded = iter([one for one in scan(edited) if isinstance(one, Recorded)])
    for nth, messages in enumerate(whole.per_chunk):
        for one in itertools.islice(recorded, len(messages)):
            chain.add(leaf(one.channel.digest, *one[2:]))
        new = chain.checkpoint()

        def fit(content: dict[str, str], new: Checkpoint = new) -> dict[str, str]:
            signature = Checkpoint.of_metadata(content).signature
            return dataclasses.replace(new, signature=signature).as_metadata()

        replace_metadata(pieces, "fras.chain", fit, nth)
    replace_metadata(pieces, "fras.closed", lambda told: told | {"head": chain.head.hex()})
    found = verify(put_together(pieces))
    assert found.only("signature"), found.findings
    # From the forged piece on, and the closing record.
    assert len(found.findings) == len(whole.chunks) - MIDDLE + 1
    assert found.signed_by == ""
    assert not found.authentic


def beginning(pieces: list[Piece]) -> tuple[dict[str, str], dict[str, bytes]]:
    opening = read(pieces[1])
    assert isinstance(opening, Metadata)
    attachments = map(read, [one for one in pieces if one.opcode == Opcode.ATTACHMENT])
    content = {one.name: one.data for one in attachments if isinstance(one, Attachment)}
    return dict(opening.metadata), content


# --- what stands beside the messages ----------------------------------------------------------


def test_a_changed_attachment(pieces: list[Piece], verify: Verify):
    index = next(i for i, piece in enumerate(pieces) if piece.opcode == Opcode.ATTACHMENT)
    told = read(pieces[index])
    assert isinstance(told, Attachment)
    pieces[index] = attachment(told.name, told.data.replace(b"seed = 1", b"seed = 2"), told)
    finding = only_chain(verify(put_together(pieces)))
    assert "an attachment was changed" in finding.text


def test_an_attachment_dropped_added_doubled(pieces: list[Piece], verify: Verify):
    index = next(i for i, piece in enumerate(pieces) if piece.opcode == Opcode.ATTACHMENT)
    told = read(pieces[index])
    assert isinstance(told, Attachment)
    dropped = [*pieces[:index], *pieces[index + 1 :]]
    assert not verify(put_together(dropped)).intact
    added = [*pieces[:index], attachment("more", b"", told), *pieces[index:]]
    assert not verify(put_together(added)).intact
    twice = [*pieces[: index + 1], attachment(told.name, b"seed = 2", told), *pieces[index + 1 :]]
    texts = [one.text for one in verify(put_together(twice)).findings]
    assert texts == ["a second attachment 'scenario.toml'"]
    late = [*pieces, attachment("late", b"seed = 2", told)]
    texts = [one.text for one in verify(put_together(late)).findings]
    assert texts == ["attachment 'late' after the messages"]


def test_a_changed_opening_record(pieces: list[Piece], verify: Verify):
    replace_metadata(pieces, "fras", lambda told: told | {"trial": "t-9"})
    finding = only_chain(verify(put_together(pieces)))
    assert "the opening record" in finding.text


@pytest.mark.parametrize("name", ["fras", "fras.closed", "fras.chain", "fras.recovered", "mine"])
def test_a_record_too_many(whole: Whole, pieces: list[Piece], verify: Verify, name: str):
    like = {"mine": {}, "fras.recovered": {}}.get(name)
    if like is None:
        like = next(
            dict(record.metadata)
            for record in map(read, [one for one in pieces if one.opcode == Opcode.METADATA])
            if isinstance(record, Metadata) and record.name == name
        )
    for index in (2, len(pieces) - 1, len(pieces)):
        forged = [*pieces[:index], metadata(name, like), *pieces[index:]]
        found = verify(put_together(forged))
        assert not found.intact, index
        assert found.findings[0].kind in ("structure", "chain", "signature")


# --- files ------------------------------------------------------------------------------------


def test_two_logs_one_behind_the_other(whole: Whole, verify: Verify):
    found = verify(whole.data + whole.data)
    assert found.messages == len(whole.messages)
    (finding,) = found.findings
    assert finding.kind == "structure"
    assert finding.offset == len(whole.data) - len(MAGIC)
    assert f"{len(whole.data)} bytes follow" in finding.text


@pytest.mark.parametrize("tail", [b"\0", b"more", MAGIC])
def test_trailing_bytes(whole: Whole, verify: Verify, tail: bytes):
    (finding,) = verify(whole.data + tail).findings
    assert f"{len(tail)} bytes follow" in finding.text


def test_an_end_in_the_middle_hides_nothing(whole: Whole, verify: Verify):
    """A record that says it is the footer, where more messages follow."""
    footer = next(one for one in frames(whole.data) if one.opcode == Opcode.FOOTER)
    raw = struct.pack("<BQ", footer.opcode, len(footer.content)) + footer.content
    middle = whole.chunks[MIDDLE].offset
    found = verify(whole.data[:middle] + raw + whole.data[middle:])
    assert found.messages == len(whole.messages)
    assert found.findings[0].offset == middle


@pytest.mark.parametrize("kind", [Opcode.CHANNEL, Opcode.STATISTICS, Opcode.CHUNK_INDEX,
                                  Opcode.METADATA_INDEX, Opcode.SCHEMA])  # fmt: skip
def test_an_index_that_is_not_of_these_data(whole: Whole, verify: Verify, kind: Opcode):
    """The stock reader that seeks goes by the index alone."""
    end = next(one.offset for one in frames(whole.data) if one.opcode == Opcode.DATA_END)
    piece = next(one for one in frames(whole.data) if one.opcode == kind and one.offset > end)
    forged = bytearray(whole.data)
    forged[piece.end - 1] ^= 1
    found = verify(repair_checksums(bytes(forged)))
    assert {one.kind for one in found.findings} == {"structure"}
    assert all(one.offset > end for one in found.findings)


def test_an_index_of_messages_that_leaves_one_out(whole: Whole, verify: Verify):
    piece = next(one for one in frames(whole.data) if one.opcode == Opcode.MESSAGE_INDEX)
    forged = bytearray(whole.data)
    forged[piece.end - 8] ^= 1
    found = verify(repair_checksums(bytes(forged)))
    assert found.findings[0].offset == piece.offset
    assert "not the index" in found.findings[0].text


def test_a_chunk_that_lies_about_its_times(whole: Whole, verify: Verify):
    """A reader that seeks by time would pass it over."""
    forged = bytearray(whole.data)
    forged[whole.chunks[MIDDLE].offset + 9] ^= 1
    found = verify(repair_checksums(bytes(forged)))
    assert found.findings[0].offset == whole.chunks[MIDDLE].offset
    assert "lies about when" in found.findings[0].text
    assert isinstance(whole.chunks[MIDDLE], ChunkPiece)
