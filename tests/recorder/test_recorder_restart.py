"""A recorder that was killed: the next one goes on in the next file, from what is still cached."""

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from fras_common.bus import RemoteFault
from fras_common.codec import decode
from fras_common.messages import LastRequest, RobotState, SinceRequest
from fras_common.service.health import ProcessMeter
from fras_common.topics import RECORDER_LAST, RECORDER_SINCE, ROBOT_STATE
from fras_log import LogFile, LogReader, verify_file
from fras_log.parts import parts_of
from fras_recorder import opening, writing

Stage = Any  # the fixture's class, in conftest.py, can't be imported from here


def ticks(path: Path) -> list[int]:
    messages = LogReader(path).messages()
    found = [one.payload for one in messages if one.key == "robot/state"]
    return [decode(RobotState, payload, "robot/state").tick for payload in found]


def finish(stage: Stage, last_tick: int) -> None:
    status = stage.task()
    stage.ask_close(last_tick, status.seq).wait()


def go_on(second: Stage, folder: Path, last_tick: int) -> None:
    """Have the next recorder open the log anew and close it."""
    try:
        second.open(folder)
        finish(second, last_tick)
    finally:
        second.end()


def test_nothing_is_lost_that_a_publisher_still_caches(stage: Stage, tmp_path: Path):
    stage.open(tmp_path)
    for tick in range(5):
        stage.tick(tick)
    stage.settle()
    second = stage.kill()
    try:
        # None of this did a recorder write.
        for tick in range(5, 8):
            stage.tick(tick)
        second.open(tmp_path)
        assert second.until("recording").path == str(tmp_path / "audit.mcap")
        for tick in range(8, 10):
            stage.tick(tick)
        finish(second, 9)
    finally:
        second.end()
    path = tmp_path / "audit.mcap"
    assert [one.name for one in parts_of(path)] == ["audit.mcap", "audit.2.mcap"]
    assert ticks(path) == list(range(10))
    found = verify_file(path)
    assert [str(one) for one in found.findings if one.kind != "interlock"] == []
    assert found.closed


def test_what_was_not_flushed_is_written_again(stage: Stage, tmp_path: Path):
    stage.open(tmp_path)
    for tick in range(5):
        stage.tick(tick)
    # At once: what waits in the first file's chunk goes with it.
    go_on(stage.kill(), tmp_path, 4)
    assert ticks(tmp_path / "audit.mcap") == list(range(5))


def test_other_trials_in_the_caches_stay_out(stage: Stage, tmp_path: Path):
    stage.tick(7, trial="t-0")
    stage.open(tmp_path)
    stage.tick(0)
    go_on(stage.kill(), tmp_path, 0)
    trials = {
        decode(RobotState, one.payload, one.key).trial
        for one in LogReader(tmp_path / "audit.mcap").messages()
        if one.key == "robot/state"
    }
    assert trials == {"t-1"}


def test_so_do_those_whose_clock_was_ahead_then(stage: Stage, tmp_path: Path):
    stage.ahead_ns = 7_200 * 10**9
    stage.tick(7, trial="t-0")
    stage.ahead_ns = 0
    stage.open(tmp_path)
    stage.tick(0)
    stage.settle()
    go_on(stage.kill(), tmp_path, 0)
    assert ticks(tmp_path / "audit.mcap") == [0]


def test_what_a_rogue_caches_under_anothers_name_stays_out(stage: Stage, tmp_path: Path):
    stage.open(tmp_path)
    stage.tick(0)
    rogue = stage.other_bus("rogue/1")
    rogue.publisher(ROBOT_STATE).put(RobotState(
        tick=0, trial="t-1", arms={}, action=None, holds={}, verdict_tick=-1
    ))  # fmt: skip
    second = stage.kill()
    try:
        assert decode(RobotState, last(second), "robot/state").source == "motion/1"
        second.open(tmp_path)
        finish(second, 0)
    finally:
        second.end()
    assert ticks(tmp_path / "audit.mcap") == [0]


def last(stage: Stage) -> bytes:
    return stage.speaker.query(RECORDER_LAST, LastRequest(key="robot/state"), 5.0).payload


def test_a_log_is_opened_once_however_often_it_is_asked_for(stage: Stage, tmp_path: Path):
    assert stage.open(tmp_path) == stage.open(tmp_path)
    stage.tick(0)
    finish(stage, 0)
    assert parts_of(tmp_path / "audit.mcap") == (tmp_path / "audit.mcap",)


def test_another_trials_log_is_not_gone_on_with(stage: Stage, tmp_path: Path):
    stage.open(tmp_path)
    second = stage.kill()
    try:
        with pytest.raises(RemoteFault, match="choose another directory"):
            second.open(tmp_path, trial="t-2")
    finally:
        second.end()


def test_a_foreign_file_in_the_way_is_told(stage: Stage, tmp_path: Path):
    (tmp_path / "audit.mcap").write_bytes(b"precious")
    with pytest.raises(RemoteFault) as caught:
        stage.open(tmp_path)
    assert caught.value.remote_kind == "NotAnMcap"
    assert (tmp_path / "audit.mcap").read_bytes() == b"precious"


def test_a_scenario_has_the_log_rotated(
    stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(writing, "FLUSH_S", 0.0)
    stage.open(tmp_path, rotate_bytes=20_000)
    for tick in range(20):
        stage.tick(tick)
        stage.settle()
    finish(stage, 19)
    path = tmp_path / "audit.mcap"
    assert len(parts_of(path)) > 2
    assert ticks(path) == list(range(20))
    assert verify_file(path).closed


def test_a_scenario_has_the_disk_waited_for(
    stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    synced: list[int] = []
    monkeypatch.setattr("os.fsync", synced.append)
    stage.open(tmp_path / "1", fsync=False)
    finish(stage, -1)
    assert synced == []
    stage.open(tmp_path / "2", trial="t-2")
    assert synced


# --- a disk that does not answer --------------------------------------------------------------


@pytest.fixture
def stuck(monkeypatch: pytest.MonkeyPatch) -> Iterator[threading.Event]:
    """Writing waits for this."""
    released = threading.Event()
    write = LogFile.write

    def blocked(file: LogFile, *arguments: Any) -> Any:
        assert released.wait(20.0)
        return write(file, *arguments)

    monkeypatch.setattr(LogFile, "write", blocked)
    yield released
    released.set()


def test_a_disk_that_does_not_answer_keeps_nobody_waiting(
    stage: Stage, tmp_path: Path, stuck: threading.Event, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(writing, "BEHIND", 5 / writing.PLACES)
    stage.open(tmp_path)
    for tick in range(4):
        stage.tick(tick)
    assert "wait to be written" in stage.until("behind").reason
    last = stage.speaker.query(RECORDER_LAST, LastRequest(key="sa/verdict"), 5.0)
    assert last.payload
    since = stage.speaker.query(RECORDER_SINCE, SinceRequest(key="sa/verdict", tick=0), 5.0)
    assert len(since.payloads) == 4
    stuck.set()
    stage.until_last("recording")
    finish(stage, 3)
    assert ticks(tmp_path / "audit.mcap") == list(range(4))


def test_one_that_falls_behind_while_the_log_is_made_says_so_when_it_is(
    stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(writing, "BEHIND", 5 / writing.PLACES)
    stage.until("idle")
    made, told = threading.Event(), threading.Event()
    make = opening.open_log
    done_with = writing.Writing._done_with  # noqa: SLF001 - nothing is written before it was told

    def slow(*arguments: Any) -> Any:
        assert made.wait(20.0)
        return make(*arguments)

    def held(one: Any, sample: Any) -> None:
        assert told.wait(20.0)
        done_with(one, sample)

    monkeypatch.setattr(opening, "open_log", slow)
    monkeypatch.setattr(writing.Writing, "_done_with", held)
    asking = threading.Thread(target=stage.open, args=(tmp_path,))
    asking.start()
    while stage.service._writing.waiting < 8:  # noqa: SLF001
        stage.verdict(0)
    made.set()
    assert "wait to be written" in stage.until("behind").reason
    told.set()
    asking.join()
    stage.until_last("recording")


@pytest.mark.parametrize("bound", ["places", "bytes"])
def test_what_no_longer_fits_is_lost_and_told(
    stage: Stage,
    tmp_path: Path,
    stuck: threading.Event,
    monkeypatch: pytest.MonkeyPatch,
    bound: str,
):
    if bound == "places":
        monkeypatch.setattr(writing, "PLACES", 40)
    else:
        monkeypatch.setattr(writing, "BYTES", 6000)
    stage.open(tmp_path)
    for tick in range(200):
        stage.robot(tick)
    # What its loop has to do counts, too.
    idle = threading.Event()
    stage.host.post(idle.set)
    assert idle.wait(20.0)
    assert stage.host.health(ProcessMeter()).queue_depth <= (40 if bound == "places" else 200)
    stuck.set()
    stage.until_last("recording")
    stage.settle()
    stage.robot(200)
    status = stage.task()
    closed = stage.ask_close(-1, status.seq).wait()
    kept = ticks(tmp_path / "audit.mcap")
    assert kept[-1] == 200
    assert 10 < len(kept) < 150
    # Each of them is known by its number.
    assert closed.lost >= 201 - len(kept)
    assert stage.host.counts["queue_dropped"] >= 201 - len(kept)
    assert stage.host.counts["gaps"] >= 201 - len(kept)
