"""A recorder that is asked at the wrong moment, or for what can't be."""

import errno
import os
import time
from pathlib import Path
from typing import Any

import msgspec
import pytest

from fras_common.bus import RawSample, RemoteFault
from fras_common.codec import encode
from fras_common.messages import OpenRequest
from fras_common.scenario import Scenario
from fras_common.topics import RECORDER_OPEN
from fras_log import LogFile, LogReader, audit_log, verify_file
from fras_log.parts import parts_of
from fras_recorder import writing

Stage = Any  # the fixture's class, in conftest.py, can't be imported from here


def request(directory: Path | str, trial: str = "t-1", **changes: Any) -> OpenRequest:
    return OpenRequest(
        trial=trial, scenario=Scenario(seed=4), mesh=b"", directory=str(directory), rules=changes
    )


def test_a_log_that_is_asked_for_twice_at_once_is_taken_up_once(
    stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    stage.open(tmp_path)
    for tick in range(5):
        stage.tick(tick)
    second = stage.kill()
    try:
        answers: list[Any] = []
        # Both wait for what is cached before either is opened.
        waiting: list[Any] = []
        bus = second.host.bus
        cached = bus.cached
        monkeypatch.setattr(bus, "cached", lambda *given: waiting.append(given))
        for _ in range(2):
            second.speaker.ask(RECORDER_OPEN, request(tmp_path), answers.append, 10.0)
        second.settle()
        monkeypatch.setattr(bus, "cached", cached)
        for given in waiting:
            cached(*given)
        second.until("recording")
        status = second.task()
        second.ask_close(4, status.seq).wait()
    finally:
        second.end()
    assert len(answers) == 2
    assert answers[0] == answers[1]
    assert not isinstance(answers[0], Exception)
    path = tmp_path / "audit.mcap"
    assert len(parts_of(path)) == 2
    assert {one.kind for one in verify_file(path).findings} <= {"interlock"}


def test_a_log_that_is_written_is_not_opened_for_another_request(stage: Stage, tmp_path: Path):
    stage.open(tmp_path)
    (tmp_path.parent / "other").symlink_to(tmp_path)
    for directory in (tmp_path, tmp_path.parent / "other"):
        other = request(directory, rules="another")
        with pytest.raises(RemoteFault, match="is being written"):
            stage.speaker.query(RECORDER_OPEN, other, 5.0)
    status = stage.task()
    stage.ask_close(-1, status.seq).wait()
    assert verify_file(tmp_path / "audit.mcap").intact


def test_a_close_waits_for_a_log_that_is_being_opened(
    stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    stage.open(tmp_path)
    stage.tick(0)
    second = stage.kill()
    try:
        waiting: list[Any] = []
        bus = second.host.bus
        cached = bus.cached
        monkeypatch.setattr(bus, "cached", lambda *given: waiting.append(given))
        second.speaker.ask(RECORDER_OPEN, request(tmp_path), lambda _: None, 10.0)
        status = second.task()
        closing = second.ask_close(0, status.seq)
        second.settle()
        assert closing.outcomes == []
        cached(*waiting[0])
        assert closing.wait().messages > 3
    finally:
        second.end()
    assert verify_file(tmp_path / "audit.mcap").closed


@pytest.mark.parametrize(
    "name", ["x" * 300, "a\0b", "/".join(["y" * 200] * 30)], ids=["long", "zero", "deep"]
)
def test_a_folder_that_can_not_be_is_refused_and_the_recorder_goes_on(
    stage: Stage, tmp_path: Path, name: str
):
    with pytest.raises(RemoteFault) as caught:
        stage.speaker.query(RECORDER_OPEN, request(f"{tmp_path}/{name}"), 5.0)
    assert caught.value.remote_kind == "LogUnwritable"
    stage.open(tmp_path / "good")


def test_a_log_that_fails_as_it_is_taken_up_is_not_said_to_be_recording(
    stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    stage.open(tmp_path)
    stage.tick(0)
    second = stage.kill()
    try:

        def full(*_: Any) -> None:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        monkeypatch.setattr(LogFile, "append", full)
        second.open(tmp_path)
        assert "No space left" in second.until("error").reason
        second.settle()
        assert second.states[-1].state == "error"
        assert second.states[-1].trial == "t-1"
    finally:
        second.end()


def test_a_clock_that_was_set_back_costs_no_number(
    stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    stage.open(tmp_path)
    stage.tick(0)
    second = stage.kill()
    now_ns = iter(range(2 * 10**18, 0, -(10**9)))
    stamper = stage._publishers["robot/state"]._stamper  # noqa: SLF001 - its clock
    monkeypatch.setattr(stamper, "_clock_ns", lambda: next(now_ns))
    try:
        for tick in range(1, 5):
            second.tick(tick)
        second.open(tmp_path)
        status = second.task()
        assert second.ask_close(4, status.seq).wait().lost == 0
    finally:
        second.end()
    found = verify_file(tmp_path / "audit.mcap")
    assert [str(one) for one in found.findings if one.kind == "sequence"] == []


def test_a_refusal_leaves_the_log_that_is_open(stage: Stage, tmp_path: Path):
    stage.open(tmp_path / "1")
    with pytest.raises(RemoteFault):
        stage.speaker.query(RECORDER_OPEN, request("x" * 300, trial="t-2"), 5.0)
    stage.tick(0)
    status = stage.task()
    stage.ask_close(0, status.seq).wait()
    assert len(LogReader(tmp_path / "1" / "audit.mcap").files) == 1


def test_nobody_hides_from_a_log_that_was_taken_up_behind_a_low_number(
    stage: Stage, tmp_path: Path
):
    for tick in range(3):
        stage.tick(tick, trial="t-0")
    stage.open(tmp_path)
    stage.tick(0)
    second = stage.kill()
    try:
        second.open(tmp_path)
        # Someone speaks under motion's name, with a number from before the log.
        header = stage.robot(1)
        rogue = msgspec.structs.replace(header, seq=0, tick=7, stamp_ns=time.time_ns())
        second.arrive(rogue, "robot/state")
        status = second.task()
        second.ask_close(1, status.seq).wait()
    finally:
        second.end()
    found = [one.payload for one in LogReader(tmp_path / "audit.mcap").messages()]
    assert encode(rogue) in found


def test_keys_without_end_go_on_in_the_next_file(
    stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """A file numbers its keys with 16 bits."""
    monkeypatch.setattr(audit_log, "CHANNELS", 50)
    stage.open(tmp_path)
    for number in range(120):
        stage.service._on_sample(RawSample(f"made/up/{number}", b"", ""))  # noqa: SLF001
    stage.settle()
    stage.ask_close(-1, stage.task().seq).wait()
    path = tmp_path / "audit.mcap"
    assert len(parts_of(path)) == 3
    assert sum(one.key.startswith("made/up/") for one in LogReader(path).messages()) == 120
    assert verify_file(path).intact


def test_a_file_in_the_place_of_the_next_one_is_told_and_stays(
    stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(writing, "FLUSH_S", 0.0)
    (tmp_path / "audit.2.mcap").write_bytes(b"precious")
    stage.open(tmp_path, rotate_bytes=1)
    stage.tick(0)
    assert "audit.2.mcap exists" in stage.until("error").reason
    assert (tmp_path / "audit.2.mcap").read_bytes() == b"precious"
    stage.open(tmp_path / "next", trial="t-2")
    assert stage.until("recording").trial == "t-2"
