"""The recorder's shell on a bus in memory: open, listen, wait, close."""

import platform
import threading
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap.records import Channel, Message

from fras_common.bus import RawSample, RemoteFault
from fras_common.codec import content_digest, decode, encode
from fras_common.digests import rules_digest, table_digest
from fras_common.messages import CloseReply, LastRequest, RecorderEvent, SinceRequest, Verdict
from fras_common.scenario import Scenario, to_toml
from fras_common.service.build import build_of_this_process
from fras_common.topics import HEALTH, QUERIES, RECORDER_LAST, RECORDER_SINCE, TOPICS
from fras_log import LogFile, verify_file
from fras_log.attachments import read_attachments, rules_in
from fras_recorder import writing
from support.verdicts import verdict

Stage = Any  # the fixture's class, in conftest.py, can't be imported from here


def recorded(path: Path) -> dict[str, list[int]]:
    with path.open("rb") as stream:
        found: dict[str, list[int]] = {}
        entry: tuple[Any, Channel, Message]
        for entry in make_reader(stream, validate_crcs=True).iter_messages():
            found.setdefault(entry[1].topic, []).append(entry[2].sequence)
    return found


def metadata(path: Path) -> dict[str, dict[str, str]]:
    with path.open("rb") as stream:
        return {record.name: record.metadata for record in make_reader(stream).iter_metadata()}


def test_a_trial_is_recorded_from_open_to_close(stage: Stage, tmp_path: Path):
    stage.until("idle")
    reply = stage.open(tmp_path, mesh=b"nodes")
    assert reply.digest == content_digest("t-1", Scenario(seed=4), b"nodes")
    path = tmp_path / "audit.mcap"
    assert stage.until("recording").path == str(path)
    for tick in range(5):
        stage.tick(tick)
    status = stage.task()
    closed = stage.ask_close(4, status.seq).wait()
    assert isinstance(closed, CloseReply)
    assert (closed.path, closed.lost) == (str(path), 0)

    found = recorded(path)
    for key in ("robot/state", "sim/tissue_state", "sa/verdict"):
        assert found[key] == [0, 1, 2, 3, 4]
    assert found["planner/task_status"] == [0]
    assert "rpc/recorder/open" in found
    assert closed.messages == sum(len(sequences) for sequences in found.values())
    final = stage.until("closed")
    assert (final.trial, final.reason, final.lost) == ("t-1", "closed", 0)
    assert (final.messages, final.bytes) == (closed.messages, path.stat().st_size)


def test_the_log_carries_the_scenario(stage: Stage, tmp_path: Path):
    stage.open(tmp_path, mesh=b"nodes")
    stage.task()
    stage.ask_close(-1, 0).wait()
    path = tmp_path / "audit.mcap"
    written = to_toml(Scenario(seed=4))
    with path.open("rb") as stream:
        attached = {a.name: a.data for a in make_reader(stream).iter_attachments()}
    assert attached == {"scenario.toml": written.encode(), "mesh": b"nodes"}
    said = metadata(path)
    assert said["fras"]["trial"] == "t-1"
    assert said["fras"]["scenario"] == written
    assert said["fras"]["fras_version"] == version("fras")
    assert said["fras"]["python_version"] == platform.python_version()
    assert said["fras"]["host"] == platform.node()
    assert said["fras"]["build"] == build_of_this_process()
    assert said["fras"]["topics_digest"] == table_digest(TOPICS, QUERIES)
    assert "asp_digest" not in said["fras"]
    assert said["fras.closed"]["reason"] == "closed"


def test_the_log_carries_the_rules_that_came_with_the_request(stage: Stage, tmp_path: Path):
    """By value: they need not be on the recorder's machine."""
    rules = {"goal.lp": "% für alle\n", "preferences/lex.lp": "% lex\n"}
    stage.open(tmp_path, rules=rules)
    stage.task()
    stage.ask_close(-1, 0).wait()
    path = tmp_path / "audit.mcap"
    attached = read_attachments(path)
    assert rules_in(attached, path) == rules
    assert set(attached) == {"scenario.toml", "asp/goal.lp", "asp/preferences/lex.lp"}
    assert metadata(path)["fras"]["asp_digest"] == rules_digest(rules)
    assert verify_file(path).intact


def test_the_close_waits_for_the_last_tick_of_each_key(
    stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("fras_recorder.closing.QUIET_S", 0.0)
    stage.open(tmp_path)
    stage.tick(0)
    status = stage.task()
    closing = stage.ask_close(1, status.seq)
    stage.robot(1)
    stage.tissue(1)
    stage.settle()
    assert closing.outcomes == []
    stage.verdict(1)
    assert isinstance(closing.wait(), CloseReply)
    assert recorded(tmp_path / "audit.mcap")["sa/verdict"] == [0, 1]


def test_the_close_waits_for_the_status(
    stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("fras_recorder.closing.QUIET_S", 0.0)
    stage.open(tmp_path)
    stage.tick(0)
    first = stage.task()
    closing = stage.ask_close(0, first.seq + 1)
    stage.settle()
    assert closing.outcomes == []
    stage.task()
    assert isinstance(closing.wait(), CloseReply)
    assert recorded(tmp_path / "audit.mcap")["planner/task_status"] == [0, 1]


def test_the_close_waits_for_a_moment_of_quiet(
    stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("fras_recorder.closing.QUIET_S", 0.5)
    stage.open(tmp_path)
    stage.tick(0)
    status = stage.task()
    closing = stage.ask_close(0, status.seq)
    stage.settle()
    assert closing.outcomes == []
    stage.tick(1)
    closing.wait()
    assert recorded(tmp_path / "audit.mcap")["robot/state"] == [0, 1]


def test_a_log_that_never_gets_complete_is_closed_in_the_end(
    stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("fras_recorder.closing.CLOSE_TIMEOUT_S", 0.1)
    stage.open(tmp_path)
    stage.tick(0)
    assert isinstance(stage.ask_close(99, 99).wait(), CloseReply)
    assert recorded(tmp_path / "audit.mcap")["robot/state"] == [0]


def test_closing_without_an_open_log_is_refused(stage: Stage):
    fault = stage.ask_close(0, 0).wait()
    assert isinstance(fault, RemoteFault)
    assert fault.remote_kind == "NothingToClose"


def test_closing_another_trials_log_is_refused(stage: Stage, tmp_path: Path):
    stage.open(tmp_path)
    fault = stage.ask_close(0, 0, trial="t-2").wait()
    assert fault.remote_kind == "NothingToClose"
    assert "t-2" in str(fault)
    assert stage.states[-1].state == "recording"


def test_a_later_close_supersedes_an_earlier_one(stage: Stage, tmp_path: Path):
    stage.open(tmp_path)
    first = stage.ask_close(7, 0)
    stage.settle()
    stage.task()
    second = stage.ask_close(-1, 0)
    assert isinstance(second.wait(), CloseReply)
    fault = first.wait()
    assert isinstance(fault, RemoteFault)
    assert "superseded" in str(fault)


def test_a_second_open_supersedes_the_first(stage: Stage, tmp_path: Path):
    stage.open(tmp_path / "1")
    stage.tick(0)
    stage.open(tmp_path / "2", trial="t-2")
    stage.tick(0, trial="t-2")
    stage.settle()
    assert metadata(tmp_path / "1" / "audit.mcap")["fras.closed"]["reason"] == "superseded"
    assert recorded(tmp_path / "1" / "audit.mcap")["robot/state"] == [0]
    status = stage.task("t-2")
    stage.ask_close(0, status.seq, trial="t-2").wait()
    assert recorded(tmp_path / "2" / "audit.mcap")["robot/state"] == [1]


def test_an_open_that_fails_does_not_cost_the_log_that_is_open(stage: Stage, tmp_path: Path):
    stage.open(tmp_path / "1")
    stage.tick(0)
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    with pytest.raises(RemoteFault, match="can't write"):
        stage.open(tmp_path / "file", trial="t-2")
    stage.tick(1)
    status = stage.task()
    stage.ask_close(1, status.seq).wait()
    assert recorded(tmp_path / "1" / "audit.mcap")["robot/state"] == [0, 1]


def test_an_open_that_supersedes_answers_the_close_that_waited(stage: Stage, tmp_path: Path):
    stage.open(tmp_path / "1")
    closing = stage.ask_close(50, 50)
    stage.open(tmp_path / "2", trial="t-2")
    assert closing.wait().path == str(tmp_path / "1" / "audit.mcap")


def test_a_log_is_never_written_over(stage: Stage, tmp_path: Path):
    stage.open(tmp_path)
    stage.task()
    stage.ask_close(-1, 0).wait()
    before = (tmp_path / "audit.mcap").read_bytes()
    with pytest.raises(RemoteFault, match="never written over") as caught:
        stage.open(tmp_path)
    assert caught.value.remote_kind == "LogExists"
    assert (tmp_path / "audit.mcap").read_bytes() == before


def test_a_directory_that_cannot_be_made_is_refused(stage: Stage, tmp_path: Path):
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    with pytest.raises(RemoteFault, match="can't write"):
        stage.open(tmp_path / "file")


def test_between_trials_nothing_is_written(stage: Stage, tmp_path: Path):
    stage.tick(0)
    stage.open(tmp_path)
    stage.task()
    closed = stage.ask_close(-1, 0).wait()
    stage.tick(1)
    stage.settle()
    assert "robot/state" not in recorded(Path(closed.path))


def test_what_is_no_message_is_recorded_too(stage: Stage, tmp_path: Path):
    stage.open(tmp_path)
    stage.speaker.carry(HEALTH, RawSample("unheard/of", b"\xc1", "text/plain"))
    stage.task()
    stage.ask_close(-1, 0).wait()
    assert "unheard/of" in recorded(tmp_path / "audit.mcap")


def test_a_quiet_second_does_not_stay_in_memory(stage: Stage, tmp_path: Path):
    stage.open(tmp_path)
    path = tmp_path / "audit.mcap"
    empty = path.stat().st_size
    stage.tick(0)
    since = time.monotonic()
    while path.stat().st_size == empty:
        stage.settle()
        assert time.monotonic() - since < 1.5


def test_a_disk_that_fails_is_said_and_survived(
    stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    def full(self: LogFile) -> None:
        raise OSError(28, "No space left on device")

    stage.open(tmp_path)
    closing = stage.ask_close(50, 50)
    monkeypatch.setattr(LogFile, "flush", full)
    status = stage.until("error")
    assert "No space left" in status.reason
    assert status.path == str(tmp_path / "audit.mcap")
    fault = closing.wait()
    assert isinstance(fault, RemoteFault)
    assert "No space left" in str(fault)
    monkeypatch.undo()
    stage.open(tmp_path / "next", trial="t-2")
    assert stage.until("recording").state == "recording"


def test_the_end_of_the_process_finishes_the_file(stage: Stage, tmp_path: Path):
    stage.open(tmp_path)
    stage.tick(0)
    stage.settle()
    stage.end()
    assert recorded(tmp_path / "audit.mcap")["sa/verdict"] == [0]
    assert metadata(tmp_path / "audit.mcap")["fras.closed"]["reason"] == "stopped"


def test_what_is_written_can_be_decoded(stage: Stage, tmp_path: Path):
    stage.open(tmp_path)
    sent = stage.verdict(0)
    stage.task()
    stage.ask_close(-1, 0).wait()
    with (tmp_path / "audit.mcap").open("rb") as stream:
        (payload,) = [
            message.data
            for _, _, message in make_reader(stream).iter_messages(topics=["sa/verdict"])
        ]
    assert decode(Verdict, payload, "sa/verdict") == sent


def a_verdict(seq: int) -> Verdict:
    return verdict(seq, seq=seq, source="sa/7")


def messages_of(path: Path, key: str, kind: Any) -> list[Any]:
    with path.open("rb") as stream:
        return [
            decode(kind, entry[2].data, key) for entry in make_reader(stream).iter_messages(key)
        ]


def test_who_is_there_comes_and_goes_and_what_is_missing_stands_in_the_log(
    stage: Stage, tmp_path: Path
):
    stage.until("idle")
    stage.speaker.announce("alive/sim")
    stage.open(tmp_path)
    stage.until("recording")
    other = stage.other_bus("visitor/9")
    other.announce("alive/visitor")
    for seq in (0, 1, 4):
        stage.arrive(a_verdict(seq), "sa/verdict")
    other.close()
    stage.ask_close(-1, -1).wait()
    events = messages_of(tmp_path / "audit.mcap", "recorder/event", RecorderEvent)
    seen = [(event.kind, event.subject, event.count) for event in events]
    assert ("present", "alive/sim/1", 0) in seen
    assert ("present", "alive/visitor/9", 0) in seen
    assert ("gap", "sa/verdict sa/7", 2) in seen
    assert ("absent", "alive/visitor/9", 0) in seen
    assert all(event.trial == "t-1" for event in events)
    assert stage.host.counts["gaps"] == 2


def test_a_recorder_with_too_much_to_write_says_so_and_when_it_has_caught_up(
    stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(writing, "BEHIND", 20 / writing.PLACES)
    monkeypatch.setattr(writing, "CAUGHT_UP", 2 / writing.PLACES)
    stage.until("idle")
    stage.open(tmp_path)
    stage.until("recording")
    slow = threading.Event()
    write = LogFile.write

    def stuck(file: LogFile, sample: RawSample, arrival_ns: int):
        slow.wait(10.0)
        return write(file, sample, arrival_ns)

    monkeypatch.setattr(LogFile, "write", stuck)
    for tick in range(60):
        stage.verdict(tick)
    slow.set()
    behind = stage.until("behind")
    assert "wait to be written" in behind.reason
    stage.until_last("recording")
    closed = stage.ask_close(-1, -1).wait()
    assert closed.lost == 0
    assert recorded(tmp_path / "audit.mcap")["sa/verdict"] == list(range(60))


def test_the_last_message_of_a_key_is_told_with_or_without_a_log(stage: Stage, tmp_path: Path):
    stage.until("idle")
    assert last(stage, "sa/verdict") == b""
    stage.verdict(1)
    # What was heard before the question is handled before it.
    first = last(stage, "sa/verdict")
    assert decode(Verdict, first, "sa/verdict").tick == 1
    stage.open(tmp_path)
    stage.until("recording")
    assert last(stage, "sa/verdict") == first
    stage.verdict(2)
    stage.speaker.query(RECORDER_LAST, LastRequest(key="health/nobody"), 5.0)
    assert decode(Verdict, last(stage, "sa/verdict"), "sa/verdict").tick == 2


def test_the_messages_since_a_tick_are_told(stage: Stage):
    sent = [stage.verdict(tick) for tick in range(5)]
    reply = stage.speaker.query(RECORDER_SINCE, SinceRequest(key="sa/verdict", tick=3), 5.0)
    assert reply.payloads == [encode(one) for one in sent[3:]]


def last(stage: Stage, key: str) -> bytes:
    return stage.speaker.query(RECORDER_LAST, LastRequest(key=key), 5.0).payload
