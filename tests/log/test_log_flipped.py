"""A bit that was flipped anywhere: it is found, nothing crashes, what is undamaged comes back."""

import random
from pathlib import Path

import pytest

from fras_log import recover_file, verify_file
from support import campaign
from support.damage import Whole, read_stock
from support.forger import Piece, frames

FLIPS = 500


def flip(whole: Whole, bit: int, path: Path) -> None:
    data = bytearray(whole.data)
    data[bit // 8] ^= 1 << bit % 8
    path.write_bytes(data)


def flip_and_check(whole: Whole, bit: int, tmp_path: Path) -> None:
    path, out = tmp_path / "flipped.mcap", tmp_path / "recovered.mcap"
    flip(whole, bit, path)
    found = verify_file(path)
    assert not found.intact, bit
    assert not found.authentic
    assert any(one.offset >= 0 for one in found.findings), found.findings
    out.unlink(missing_ok=True)
    recover_file(path, out, 1)
    back = read_stock(out.read_bytes())
    # A bit that the compression does not use takes nothing away.
    assert back in (whole.undamaged(bit // 8), whole.messages), bit
    assert_whole(out)


def assert_whole(out: Path) -> None:
    """But for the messages that are lost, of which the numbers tell."""
    found = verify_file(out)
    assert found.closed
    assert found.chained == found.messages
    assert found.intact or found.only("sequence", "interlock"), found.findings


def test_random_bits(whole: Whole, tmp_path: Path):
    for bit in random.Random(2).sample(range(8 * len(whole.data)), FLIPS):
        flip_and_check(whole, bit, tmp_path)


@pytest.mark.parametrize("byte", range(9))
def test_bits_of_what_frames_the_records(whole: Whole, tmp_path: Path, byte: int):
    """Kind and length: where a wrong one would lead away from all that follows."""
    path = tmp_path / "flipped.mcap"
    kinds: dict[int, Piece] = {}
    for piece in frames(whole.data):
        kinds.setdefault(piece.opcode, piece)
    assert len(kinds) >= 10
    for piece in kinds.values():
        for bit in range(byte % 2, 8, campaign.length(2, 6)):
            position = piece.offset + byte
            flip(whole, 8 * position + bit, path)
            assert not verify_file(path).intact, (piece.opcode, bit)
            out = tmp_path / "recovered.mcap"
            out.unlink(missing_ok=True)
            recover_file(path, out, 1)
            assert read_stock(out.read_bytes()) == whole.undamaged(position), (piece.opcode, bit)
            assert_whole(out)


def test_a_chunk_that_is_lost_is_told_once(whole: Whole, tmp_path: Path):
    """Not again by each checkpoint behind it, nor by what the lost messages leave behind."""
    path = tmp_path / "flipped.mcap"
    middle = whole.chunks[4]
    flip(whole, 8 * (middle.offset + 60), path)
    found = verify_file(path)
    kinds = [one.kind for one in found.findings]
    assert kinds == ["structure", "chain", "chain", "structure"], found.findings
    assert found.findings[0].offset == middle.offset
    assert "this piece is lost" in found.findings[1].text
    assert found.chained == len(whole.before(middle.offset))
    assert found.messages == len(whole.messages) - len(whole.per_chunk[4])
