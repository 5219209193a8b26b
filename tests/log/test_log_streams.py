"""Whom a log remembers: enough to know copies and gaps, and no more for any number of names."""

from pathlib import Path

import pytest

from fras_common.bus import RawSample
from fras_common.codec import HeaderFields, encode
from fras_common.messages import RecorderEvent
from fras_log import AuditLog, LogHeading, LogReader, audit_log, verify_file
from fras_log.parts import parts_of
from fras_log.streams import OTHER_KEYS, SOURCES, Streams
from support.damage import OPENING, START_NS

KEY, OTHER = "sa/verdict", "sim/tissue_state"


def header(source: str, seq: int) -> HeaderFields:
    return HeaderFields(START_NS + seq, 0, seq, source, "t-1")


def test_a_flood_of_names_on_one_key_hides_no_gap_on_another():
    streams = Streams()
    streams.note(OTHER, header("sim/1", 4))
    for number in range(10 * SOURCES):
        assert streams.note(KEY, header(f"sa/{number}", 7)) == 0
        assert streams.note(KEY, header("sa/genuine", 2 * number)) == (1 if number else 0)
    assert len(streams.ends[KEY]) == SOURCES
    assert streams.note(OTHER, header("sim/1", 4)) is None
    assert streams.note(OTHER, header("sim/1", 7)) == 2
    assert streams.note(KEY, header("sa/genuine", 20 * SOURCES - 2)) is None


def test_one_that_comes_late_makes_no_gap_of_what_came_before_it():
    streams = Streams()
    for seq in (5, 6, 7, 4):
        assert streams.note(KEY, header("sa/1", seq)) == 0
    assert streams.note(KEY, header("sa/1", 8)) == 0
    assert streams.note(KEY, header("sa/1", 2)) == 0
    assert streams.note(KEY, header("sa/1", 10)) == 2  # 3 and 9


def test_keys_without_end_are_forgotten_and_those_of_ours_never():
    streams = Streams({KEY: {"sa/1": 5}})
    for number in range(2 * OTHER_KEYS):
        streams.note(f"rogue/{number}", header("rogue/1", 0))
    assert len(streams.ends) == OTHER_KEYS + 1
    assert streams.precedes(KEY, header("sa/1", 5))
    assert streams.note(KEY, header("sa/1", 8)) == 2
    assert not streams.precedes("rogue/0", header("rogue/1", 0))
    assert streams.note(f"rogue/{2 * OTHER_KEYS - 1}", header("rogue/1", 0)) is None


def test_a_log_of_more_keys_than_a_file_can_number_has_several_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(audit_log, "CHANNELS", 8)
    path = tmp_path / "audit.mcap"
    log = AuditLog(path, LogHeading(OPENING), START_NS)
    event = RecorderEvent(stamp_ns=START_NS, kind="gap", subject="", count=0, source="rogue/1")
    for number in range(30):
        log.write(RawSample(f"rogue/{number}", encode(event), ""), START_NS + number)
    log.close("closed", START_NS + 30)
    assert len(parts_of(path)) == 4
    assert [one.key for one in LogReader(path).messages()] == [f"rogue/{n}" for n in range(30)]
    assert {one.kind for one in verify_file(path).findings} <= {"schema"}
