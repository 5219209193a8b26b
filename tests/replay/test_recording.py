"""A log read: what is due when, what is marked, what is wrong with it."""

from pathlib import Path

import pytest
from mcap.writer import Writer
from msgspec.structs import replace

from fras_common.codec import encode
from fras_common.messages.sa import Level
from fras_common.topics import Qos
from fras_log import ForeignLog, NoSuchLog, NotAnMcap
from fras_replay.errors import NothingToReplay
from fras_replay.recording import Recording, read_recording
from fras_replay.selection import Selection
from support.recordings import (
    START_NS,
    Said,
    plan,
    robot,
    said,
    short_trial,
    tick_of,
    write_log,
)

ALL = Selection()


def content(recording: Recording) -> list[tuple[str, bytes, str]]:
    messages = [recording.message(n) for n in range(recording.timeline.end.before)]
    return [(recording.lines[one.line].key, one.payload, one.encoding) for one in messages]


def read(tmp_path: Path, messages: list[Said], selection: Selection = ALL) -> Recording:
    return read_recording(write_log(tmp_path / "audit.mcap", messages), selection)


def test_all_of_it_is_there_verbatim_and_in_order(tmp_path: Path):
    messages = [*short_trial(), Said("any/text", b"", 10**9, "text/plain")]
    recording = read(tmp_path, messages)
    assert content(recording) == [(one.key, one.payload, one.encoding) for one in messages]
    assert list(recording.timeline.due_ns) == [one.at_ns for one in messages]
    assert (recording.trial, recording.began_ns) == ("t-1", START_NS)
    assert recording.damage == []
    classes = {line.key: line.qos for line in recording.lines}
    assert classes["planner/plan"] is Qos.EVENT
    assert classes["psm1/jaw/servo_jp"] is Qos.COMMAND
    assert classes["any/text"] is Qos.STATE
    recording.close()


def test_marks_tell_plans_crossings_actions_and_stops(tmp_path: Path):
    recording = read(tmp_path, short_trial())
    told = [(mark.told.kind, mark.told.tick) for mark in recording.marks]
    assert told == [
        ("plan", -1),
        ("action_start", 0),
        ("crossing", 3),
        ("re_plan", 4),
        ("action_start", 5),
        ("hold", 6),
    ]
    texts = [mark.told.text for mark in recording.marks]
    assert texts[2] == "soft: 0.51 N of 0.50 N"
    assert texts[3] == "force: grasp(psm1)"
    assert texts[5] == "cli: stop pressed"
    for mark in recording.marks:
        # The message itself stands before the place, so that a seek there shows it.
        assert recording.timeline.due_ns[mark.place.before - 1] == mark.place.at_ns
        assert mark.told.position_s == mark.place.at_ns / 1e9
    places = [mark.place for mark in recording.marks]
    assert [recording.mark_at(place) for place in places] == [0, 1, 2, 3, 4, 5]
    assert [recording.mark_before(place, 0) for place in places] == [-1, 0, 1, 2, 3, 4]
    assert recording.mark_before(places[5], 35_000_000) == 3
    recording.close()


def test_a_level_is_marked_where_it_rises_or_changes_and_not_while_it_lasts(tmp_path: Path):
    levels: list[Level] = ["ok", "soft", "soft", "hard", "ok", "ok", "soft", "invalid"]
    ticks = [
        one for tick, level in enumerate(levels) for one in tick_of(tick, tick * 20_000_000, level)
    ]
    recording = read(tmp_path, ticks)
    assert [mark.told.tick for mark in recording.marks] == [1, 3, 6, 7]
    recording.close()


def test_ticks_and_marks_stay_where_a_filter_leaves_their_messages_out(tmp_path: Path):
    recording = read(tmp_path, short_trial(), Selection(include=["planner/plan"]))
    timeline = recording.timeline
    assert timeline.end.before == 2
    assert [mark.told.kind for mark in recording.marks][:3] == ["plan", "action_start", "crossing"]
    assert timeline.last_tick == 9
    assert timeline.after_tick(4).before == 1
    assert timeline.after_tick(5).before == 2
    place = timeline.begin
    for _ in range(3):
        place = timeline.next_verdict(place)
    assert timeline.tick(place) == 2
    recording.close()


def test_a_clock_that_was_set_back_keeps_the_order(tmp_path: Path):
    messages = [*tick_of(0, 0), *tick_of(1, 50_000_000), *tick_of(2, 10_000_000)]
    recording = read(tmp_path, messages)
    ms = [at_ns // 1_000_000 for at_ns in recording.timeline.due_ns]
    assert ms == [0, 8, 50, 58, 58, 58]
    recording.close()


def test_ticks_of_another_trial_and_said_again_are_none_of_this_one(tmp_path: Path):
    old = said("robot/state", robot(300, trial="t-0"), 0)
    again = said("robot/state", replace(robot(0), seq=9, stamp_ns=9), 30_000_000)
    recording = read(tmp_path, [old, *tick_of(0, 1_000_000), again, *tick_of(1, 40_000_000)])
    assert recording.timeline.starts.numbers == [0, 1]
    assert recording.timeline.end.before == 6
    recording.close()


def test_what_says_how_things_stand_is_shown_again_and_what_happened_is_not(tmp_path: Path):
    recording = read(tmp_path, short_trial())
    timeline = recording.timeline
    shown = [
        recording.lines[recording.message(number).line].key
        for number in timeline.picture(timeline.end.before)
    ]
    assert shown == ["planner/plan", "motion/holds", "robot/state", "sa/verdict"]
    recording.close()


def test_a_message_that_does_not_decode_marks_nothing_and_is_replayed(tmp_path: Path):
    messages = [Said("planner/plan", b"\xc1", 0), said("planner/plan", plan("initial"), 5)]
    recording = read(tmp_path, messages)
    assert [mark.told.kind for mark in recording.marks] == ["plan"]
    assert content(recording)[0][1] == b"\xc1"
    recording.close()


def test_a_log_that_was_cut_gives_what_it_holds(tmp_path: Path):
    whole = write_log(tmp_path / "audit.mcap", short_trial() * 400)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size * 2 // 3])
    recording = read_recording(cut, ALL)
    assert 0 < recording.timeline.end.before < len(short_trial()) * 400
    assert recording.damage
    assert "offset" in recording.damage[0]
    recording.close()


def foreign(path: Path) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2")
        channel = writer.register_channel("imu", "cdr", 0)
        writer.add_message(channel, 0, b"x", 0)
        writer.finish()


def test_what_is_no_log_of_ours_is_named(tmp_path: Path):
    path = tmp_path / "audit.mcap"
    with pytest.raises(NoSuchLog):
        read_recording(path, ALL)
    path.write_bytes(b"")
    with pytest.raises(NotAnMcap, match="empty"):
        read_recording(path, ALL)
    path.write_bytes(b"no log at all, but text")
    with pytest.raises(NotAnMcap, match="magic"):
        read_recording(path, ALL)
    foreign(path)
    with pytest.raises(ForeignLog, match="no record"):
        read_recording(path, ALL)


def test_a_log_without_messages_is_named(tmp_path: Path):
    path = write_log(tmp_path / "audit.mcap", [])
    with pytest.raises(NothingToReplay, match="no message"):
        read_recording(path, ALL)
    other = write_log(tmp_path / "other.mcap", [Said("health/replay", encode(robot(0)), 0)])
    with pytest.raises(NothingToReplay, match="left out"):
        read_recording(other, ALL)
