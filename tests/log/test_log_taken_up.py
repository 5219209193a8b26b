"""What the recorder that goes on with a log knows of the files before its own."""

import errno
import os
from pathlib import Path

import pytest

from fras_common.codec import HeaderFields
from fras_log import (
    AuditLog,
    ForeignLog,
    LogExists,
    LogFile,
    LogHeading,
    Signer,
    take_up,
    verify_file,
)
from fras_log.parts import parts_of
from support.damage import OPENING, START_NS, Recording, robot, verdict

TICKS = 120
PART_BYTES = 20_000


def heading(signer: Signer | None = None, rotate_bytes: int = 0) -> LogHeading:
    return LogHeading(OPENING, {"scenario.toml": b"seed = 4"}, signer, rotate_bytes=rotate_bytes)


def record(recording: Recording, ticks: range) -> None:
    for tick in ticks:
        recording.tick(tick)
        recording.file.flush(recording.now_ns)  # pyright: ignore


def test_what_was_said_once_is_not_recorded_again_however_often_a_recorder_is_killed(
    tmp_path: Path, signer: Signer
):
    path = tmp_path / "audit.mcap"
    log = AuditLog(path, heading(signer), START_NS)
    recording = Recording(log)
    recording.put("log/sim", robot(20), skip=3)
    for tick in range(0, 16, 4):
        record(recording, range(tick, tick + 4))
        log.abandon()
        recording.file = log = take_up(path, heading(signer), recording.now_ns)
    assert len(parts_of(path)) == 5
    assert log.precedes("log/sim", HeaderFields(START_NS, 20, 3, "log/1", "t-1"))
    assert not log.precedes("log/sim", HeaderFields(START_NS, 20, 4, "log/1", "t-1"))
    assert not log.precedes("log/sim", HeaderFields(START_NS, 20, 3, "log/2", "t-1"))
    # What never arrived before is not forgotten either, and what is missing now is told.
    lost = log.lost
    recording.put("log/sim", robot(20), skip=2)
    assert log.lost == lost + 2
    log.close("closed", recording.now_ns)
    found = {one.kind for one in verify_file(path, [signer.public]).findings}
    assert found == {"sequence", "schema"}


def test_what_never_arrived_before_a_recorder_was_killed_is_counted(tmp_path: Path, signer: Signer):
    path = tmp_path / "audit.mcap"
    log = AuditLog(path, heading(signer, rotate_bytes=PART_BYTES), START_NS)
    recording = Recording(log)
    record(recording, range(4))
    recording.put("sa/verdict", verdict(4), skip=5)
    record(recording, range(5, TICKS))
    recording.put("sa/verdict", verdict(TICKS), skip=7)
    log.flush(recording.now_ns)
    log.abandon()
    assert log.lost == 12
    assert len(parts_of(path)) > 3
    later = take_up(path, heading(signer), recording.now_ns)
    assert later.lost == 12
    later.abandon()


@pytest.mark.parametrize("name", ["opened_ns", "messages_before", "lost_before", "sent_before"])
def test_an_opening_record_that_says_nonsense_is_refused(tmp_path: Path, name: str):
    path = tmp_path / "audit.mcap"
    LogFile(path, OPENING | {name: "[}"}, {}, START_NS).abandon()
    with pytest.raises(ForeignLog, match=name):
        take_up(path, heading(), START_NS)


# --- a file that never began ------------------------------------------------------------------


class Killed(BaseException):
    """As no code can catch it."""


def dies(file: LogFile) -> None:
    file.abandon()
    raise Killed


def is_full(*_: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_recorder_killed_as_it_begins_a_file_is_gone_on_from(
    tmp_path: Path, signer: Signer, monkeypatch: pytest.MonkeyPatch
):
    path = tmp_path / "audit.mcap"
    log = AuditLog(path, heading(signer), START_NS)
    recording = Recording(log)
    record(recording, range(8))
    log.abandon()
    with monkeypatch.context() as patch:
        patch.setattr(LogFile, "flush", dies)
        with pytest.raises(Killed):
            take_up(path, heading(signer), recording.now_ns)
    assert verify_file(path).only("end")
    recording.file = log = take_up(path, heading(signer), recording.now_ns)
    record(recording, range(8, 12))
    log.close("closed", recording.now_ns)
    assert verify_file(path, [signer.public]).authentic
    assert {one.name for one in tmp_path.iterdir()} == {
        "audit.mcap", "audit.2.mcap", "audit.manifest.json"
    }  # fmt: skip


def test_a_disk_too_full_for_the_next_file_leaves_none_of_it(
    tmp_path: Path, signer: Signer, monkeypatch: pytest.MonkeyPatch
):
    path = tmp_path / "audit.mcap"
    log = AuditLog(path, heading(signer, rotate_bytes=PART_BYTES), START_NS)
    recording = Recording(log)
    monkeypatch.setattr(LogFile, "_begin", is_full)
    with pytest.raises(OSError, match="No space"):
        record(recording, range(TICKS))
    log.abandon()
    assert [one.name for one in tmp_path.iterdir()] == ["audit.mcap"]
    assert verify_file(path).only("end")


def test_a_disk_too_full_to_end_a_file_leaves_the_next_one_to_go_on(
    tmp_path: Path, signer: Signer, monkeypatch: pytest.MonkeyPatch
):
    path = tmp_path / "audit.mcap"
    log = AuditLog(path, heading(signer, rotate_bytes=PART_BYTES), START_NS)
    recording = Recording(log)
    monkeypatch.setattr(LogFile, "close", is_full)
    with pytest.raises(OSError, match="No space"):
        record(recording, range(TICKS))
    log.abandon()
    monkeypatch.undo()
    assert len(parts_of(path)) == 2
    assert verify_file(path).only("end")
    log = take_up(path, heading(signer), recording.now_ns)
    log.close("closed", recording.now_ns)
    assert verify_file(path, [signer.public]).authentic


@pytest.mark.parametrize("links", [True, False])
def test_a_file_that_came_meanwhile_is_not_written_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: bool
):
    path = tmp_path / "audit.mcap"
    flush = LogFile.flush

    def another_came(file: LogFile) -> None:
        flush(file)
        path.write_text("precious")

    def unknown(*_: object) -> None:
        raise OSError(errno.EPERM, os.strerror(errno.EPERM))

    monkeypatch.setattr(LogFile, "flush", another_came)
    if not links:
        monkeypatch.setattr(os, "link", unknown)
    with pytest.raises(LogExists):
        AuditLog(path, heading(), START_NS)
    assert path.read_text() == "precious"
    assert [one.name for one in tmp_path.iterdir()] == ["audit.mcap"]


def test_a_file_system_without_links_serves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def unknown(*_: object) -> None:
        raise OSError(errno.EPERM, os.strerror(errno.EPERM))

    monkeypatch.setattr(os, "link", unknown)
    path = tmp_path / "audit.mcap"
    AuditLog(path, heading(), START_NS).close("closed", START_NS)
    assert verify_file(path).intact
    assert [one.name for one in tmp_path.iterdir()] == ["audit.mcap"]


def test_two_recorders_that_write_one_log_at_once_are_told(tmp_path: Path, signer: Signer):
    path = tmp_path / "audit.mcap"
    one = AuditLog(path, heading(signer), START_NS)
    first = Recording(one)
    for tick in range(3):
        first.tick(tick)
    one.flush(START_NS)
    two = take_up(path, heading(signer), START_NS)
    first.tick(3)
    one.close("closed", START_NS)
    two.close("closed", START_NS)
    found = verify_file(path, [signer.public])
    assert not found.authentic
    assert any("goes on after 9 messages" in finding.text for finding in found.findings)
