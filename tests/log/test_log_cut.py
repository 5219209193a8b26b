"""A log that was cut anywhere: what was flushed comes back, and the chain says where it ends."""

import random
from pathlib import Path

import pytest

from fras_log import LogFile, NotAnMcap, recover_file, verify_file
from support.damage import OPENING, START_NS, Message, Recording, Whole, read_stock, tissue
from support.forger import frames

CUTS = 200


def assert_recovered_from(path: Path, expected: list[Message], tmp_path: Path) -> None:
    before = path.read_bytes()
    out = tmp_path / "recovered.mcap"
    out.unlink(missing_ok=True)
    recovery = recover_file(path, out, 1)
    assert path.read_bytes() == before
    assert read_stock(out.read_bytes()) == expected
    assert recovery.messages == len(expected)
    again = verify_file(out)
    assert again.findings == []
    assert again.intact


def cut_and_check(whole: Whole, at: int, tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(whole.data[:at])
    if at < 8:
        with pytest.raises(NotAnMcap):
            verify_file(path)
        return
    expected = whole.before(at)
    found = verify_file(path)
    assert not found.intact
    assert not found.closed
    assert not found.authentic
    (end,) = [one for one in found.findings if one.kind == "end"]
    assert 0 <= end.offset <= at
    assert {one.kind for one in found.findings} <= {"end", "chain", "structure"}
    assert found.messages == len(expected)
    vouched = [chunk for chunk in whole.chunks if chunk.end <= at]
    assert found.chained >= len(expected) - (
        len(whole.per_chunk[len(vouched) - 1]) if vouched else 0
    )
    assert_recovered_from(path, expected, tmp_path)


def test_at_random_offsets(whole: Whole, tmp_path: Path):
    chosen = random.Random(1).sample(range(len(whole.data)), CUTS)
    for at in chosen:
        cut_and_check(whole, at, tmp_path)


def test_at_every_record(whole: Whole, tmp_path: Path):
    boundaries = [piece.offset for piece in frames(whole.data)]
    assert len(boundaries) > 80
    for at in boundaries:
        cut_and_check(whole, at, tmp_path)


def test_a_cut_behind_a_checkpoint_costs_nothing_that_was_recorded(whole: Whole, tmp_path: Path):
    """All that is there is vouched for; only the end is missing."""
    second = whole.chunks[2].offset
    path = tmp_path / "cut.mcap"
    path.write_bytes(whole.data[:second])
    found = verify_file(path)
    assert found.only("end")
    assert found.chained == found.messages == len(whole.before(second)) > 0
    assert found.findings[0].offset == second


def test_a_log_that_is_still_written(tmp_path: Path):
    """What was flushed is vouched for, while more is being written."""
    path = tmp_path / "audit.mcap"
    file = LogFile(path, OPENING, {}, START_NS)
    recording = Recording(file)
    for tick in range(20):
        recording.tick(tick)
        if tick % 5 == 4:
            file.flush()
            recording.put("sim/tissue_state", tissue(tick))
            found = verify_file(path)
            assert found.only("end"), found.findings
            assert found.messages == found.chained == file.messages - 1
    file.close({})
    assert verify_file(path).messages == file.messages


def test_a_log_that_grows_while_it_is_read(tmp_path: Path):
    """As much is read as there was at first; nothing is taken for damage."""
    path = tmp_path / "audit.mcap"
    file = LogFile(path, OPENING, {}, START_NS)
    recording = Recording(file)
    for tick in range(10):
        recording.tick(tick)
        file.flush()
    flushed = file.messages

    def write_more(_: int, __: int) -> None:
        recording.tick(recording.now_ns)
        file.flush()

    found = verify_file(path, progress=write_more)
    assert found.messages == found.chained == flushed
    assert file.messages > flushed
    assert found.only("end")
    file.abandon()


def test_a_log_that_is_cut_while_it_is_read(whole: Whole, tmp_path: Path):
    """A mapped file would end the process here."""
    path = tmp_path / "audit.mcap"
    path.write_bytes(whole.data)
    middle = whole.chunks[4].offset

    def cut(position: int, _: int) -> None:
        if position >= middle and path.stat().st_size > middle:
            with path.open("rb+") as file:
                file.truncate(middle)

    found = verify_file(path, progress=cut)
    assert not found.intact
    assert found.messages == len(whole.before(middle))
