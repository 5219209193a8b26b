"""A log of several files: each goes on where the one before ended, nothing is lost between."""

import json
import os
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from fras_common.codec import read_header
from fras_log import (
    AuditLog,
    LogExists,
    LogFile,
    LogHeading,
    LogReader,
    Signer,
    Verification,
    recover_file,
    scan_log,
    take_up,
    verify_file,
)
from fras_log.events import Broken, Cut, Recorded
from fras_log.parts import parts_of, read_manifest
from support.damage import OPENING, START_NS, Recording, read_stock, robot, verdict

TICKS = 120
PART_BYTES = 20_000


def heading(signer: Signer | None = None, **options: float) -> LogHeading:
    return LogHeading(OPENING, {"scenario.toml": b"seed = 4"}, signer, **options)  # pyright: ignore


def record(log: AuditLog, ticks: Sequence[int], recording: Recording | None = None) -> Recording:
    recording = recording or Recording(log)
    recording.file = log
    for tick in ticks:
        recording.tick(tick)
        if tick % 4 == 3:
            log.flush(recording.now_ns)
    return recording


@pytest.fixture
def rotated(tmp_path: Path, signer: Signer) -> Path:
    """A log that grew into several files."""
    path = tmp_path / "audit.mcap"
    log = AuditLog(path, heading(signer, rotate_bytes=PART_BYTES), START_NS)
    recording = record(log, range(TICKS))
    log.close("closed", recording.now_ns)
    assert len(parts_of(path)) > 3
    return path


@pytest.fixture
def killed(tmp_path: Path, signer: Signer) -> tuple[Path, AuditLog, Recording]:
    """A log whose recorder was killed behind a checkpoint, and the one that went on with it."""
    path = tmp_path / "audit.mcap"
    log = AuditLog(path, heading(signer), START_NS)
    recording = record(log, range(20))
    log.abandon()
    later = take_up(path, heading(signer), recording.now_ns + 10**9)
    return path, later, recording


def ticks(path: Path) -> list[int]:
    found = [
        read_header(one.payload) for one in LogReader(path).messages() if one.key == "sa/verdict"
    ]
    return [one.tick for one in found if one is not None]


def kinds(found: Verification) -> set[str]:
    return {one.kind for one in found.findings}


def test_a_log_rotates_by_size_and_is_one_log(rotated: Path, signer: Signer):
    files = parts_of(rotated)
    sizes = [file.stat().st_size for file in files]
    # A flush may be that much too late; the index comes behind.
    assert all(size < 2 * PART_BYTES for size in sizes)
    found = verify_file(rotated, [signer.public])
    assert found.findings == []
    assert found.authentic
    assert found.parts == len(files)
    assert found.unfinished == []
    assert found.messages == found.chained == 3 * TICKS
    assert ticks(rotated) == list(range(TICKS))
    assert LogReader(rotated).files == files


def test_each_file_is_whole_for_any_reader(rotated: Path):
    messages = [read_stock(file.read_bytes()) for file in parts_of(rotated)]
    assert sum(len(one) for one in messages) == 3 * TICKS


def test_the_head_of_the_last_file_is_that_of_the_log(rotated: Path):
    head = LogReader(parts_of(rotated)[-1])
    list(head.messages())
    assert verify_file(rotated, head=head.closing["head"]).intact
    assert "not the one that was noted" in str(verify_file(rotated, head="ab" * 32).findings[-1])


def test_the_manifest_tells_of_all_files(rotated: Path):
    manifest = read_manifest(rotated.with_suffix(".manifest.json"))
    assert manifest is not None
    assert [one.file for one in manifest.parts] == [one.name for one in parts_of(rotated)]
    assert [one.reason for one in manifest.parts] == ["size"] * (len(manifest.parts) - 1) + [
        "closed"
    ]
    assert [one.bytes for one in manifest.parts] == [
        one.stat().st_size for one in parts_of(rotated)
    ]
    assert sum(one.messages for one in manifest.parts) == 3 * TICKS


def test_a_log_rotates_by_time(tmp_path: Path):
    path = tmp_path / "audit.mcap"
    log = AuditLog(path, heading(rotate_s=0.01), START_NS)
    recording = record(log, range(TICKS))
    log.close("closed", recording.now_ns)
    # 1.5 ms a tick, flushed each four.
    assert len(parts_of(path)) == pytest.approx(TICKS * 1.5 / 12, abs=1)
    assert verify_file(path).intact
    manifest = read_manifest(path.with_suffix(".manifest.json"))
    assert manifest is not None
    assert manifest.parts[0].reason == "time"


def test_an_empty_file_does_not_rotate_by_time(tmp_path: Path):
    path = tmp_path / "audit.mcap"
    log = AuditLog(path, heading(rotate_s=0.01), START_NS)
    log.flush(START_NS + 10**12)
    log.close("closed", START_NS + 10**12)
    assert parts_of(path) == (path,)
    assert not path.with_suffix(".manifest.json").exists()


def test_counts_run_over_all_files(tmp_path: Path):
    path = tmp_path / "audit.mcap"
    log = AuditLog(path, heading(rotate_bytes=PART_BYTES), START_NS)
    recording = record(log, range(20))
    recording.put("log/sim", robot(20))
    recording.put("log/sim", robot(20), skip=4)
    record(log, range(20, TICKS), recording)
    log.close("closed", recording.now_ns)
    assert log.messages == 3 * TICKS + 2
    assert log.lost == 4
    assert log.bytes_written == sum(file.stat().st_size for file in parts_of(path))


# --- a recorder that was killed ---------------------------------------------------------------


def test_the_next_recorder_goes_on_in_the_next_file(
    killed: tuple[Path, AuditLog, Recording], signer: Signer
):
    path, log, recording = killed
    assert log.file == path.with_name("audit.2.mcap")
    assert log.began_ns == START_NS
    record(log, range(20, TICKS), recording)
    log.close("closed", recording.now_ns)
    found = verify_file(path, [signer.public])
    assert found.findings == []
    assert found.authentic
    assert found.unfinished == ["audit.mcap"]
    assert found.messages == found.chained == log.messages == 3 * TICKS
    assert ticks(path) == list(range(TICKS))
    manifest = read_manifest(path.with_suffix(".manifest.json"))
    assert manifest is not None
    assert [one.reason for one in manifest.parts] == ["killed", "closed"]


def test_what_the_caches_send_again_is_not_recorded_again(
    killed: tuple[Path, AuditLog, Recording], signer: Signer
):
    path, log, recording = killed
    again = Recording(log)
    record(log, range(20), again)
    assert log.messages == 3 * 20
    record(log, range(20, 24), recording)
    log.close("closed", recording.now_ns)
    assert ticks(path) == list(range(24))
    assert verify_file(path, [signer.public]).authentic


def test_what_is_missing_between_two_recorders_is_counted(
    killed: tuple[Path, AuditLog, Recording],
):
    path, log, recording = killed
    recording.file = log
    for tick in range(20, 23):
        recording.put("sa/verdict", verdict(tick), skip=2)
    log.close("closed", recording.now_ns)
    assert log.lost == 6
    assert {one.kind for one in verify_file(path).findings} == {"sequence"}


def test_a_manifest_that_a_power_cut_took_costs_nothing(
    killed: tuple[Path, AuditLog, Recording], signer: Signer
):
    path, log, recording = killed
    record(log, range(20, 24), recording)
    log.abandon()
    path.with_suffix(".manifest.json").write_bytes(b"")
    third = take_up(path, heading(signer), recording.now_ns + 10**9)
    record(third, range(24, 28), recording)
    third.close("closed", recording.now_ns)
    assert ticks(path) == list(range(28))
    assert verify_file(path, [signer.public]).authentic


def test_a_file_cut_in_mid_record_is_gone_on_from(tmp_path: Path, signer: Signer):
    path = tmp_path / "audit.mcap"
    log = AuditLog(path, heading(signer), START_NS)
    recording = record(log, range(20))
    log.abandon()
    # As a kill in the middle of a write leaves it.
    os.truncate(path, path.stat().st_size - 1000)
    later = take_up(path, heading(signer), recording.now_ns)
    kept = later.messages
    record(later, range(20), Recording(later))
    later.close("closed", recording.now_ns)
    assert kept < 60
    assert later.messages == 60
    assert verify_file(path, [signer.public]).authentic
    assert sorted(ticks(path)) == list(range(20))


@pytest.mark.parametrize("how", ["finished", "other trial", "other scenario"])
def test_another_log_is_never_gone_on_with(tmp_path: Path, how: str):
    path = tmp_path / "audit.mcap"
    log = AuditLog(path, heading(), START_NS)
    record(log, range(4))
    if how == "finished":
        log.close("closed", START_NS)
    else:
        log.abandon()
    before = path.read_bytes()
    change = {"other trial": {"trial": "t-9"}, "other scenario": {"scenario": "seed = 5"}}
    other = LogHeading(OPENING | change.get(how, {}))
    with pytest.raises(LogExists, match="choose another directory"):
        take_up(path, other, START_NS)
    assert path.read_bytes() == before
    assert parts_of(path) == (path,)


def test_a_recorder_that_was_stopped_is_gone_on_from(tmp_path: Path, signer: Signer):
    path = tmp_path / "audit.mcap"
    log = AuditLog(path, heading(signer), START_NS)
    recording = record(log, range(20))
    log.close("stopped", recording.now_ns)
    later = take_up(path, heading(signer), recording.now_ns)
    record(later, range(20, 24), recording)
    later.close("closed", recording.now_ns)
    assert verify_file(path, [signer.public]).authentic
    assert ticks(path) == list(range(24))


# --- damage -----------------------------------------------------------------------------------


def remove(number: int) -> Callable[[tuple[Path, ...]], None]:
    return lambda files: files[number].unlink()


def swap(files: tuple[Path, ...]) -> None:
    files[1].rename(files[1].with_suffix(".away"))
    files[2].rename(files[1])
    files[1].with_suffix(".away").rename(files[2])


def cut(number: int, left: float = 0.3) -> Callable[[tuple[Path, ...]], None]:
    def do(files: tuple[Path, ...]) -> None:
        os.truncate(files[number], int(files[number].stat().st_size * left))

    return do


INDEX_CUT = cut(1, 0.95)


def another(files: tuple[Path, ...]) -> None:
    files[1].unlink()
    LogFile(files[1], OPENING, {}, START_NS).close({"reason": "closed"})


def foreign(files: tuple[Path, ...]) -> None:
    files[1].write_bytes(b"no log")


@pytest.mark.parametrize(
    ("damage", "expected"),
    [
        (remove(1), "parts"),
        (remove(-1), "parts"),
        (swap, "parts"),
        (cut(0), "chain"),
        (INDEX_CUT, "parts"),
        (cut(-1), "end"),
        (another, "parts"),
        (foreign, "parts"),
    ],
    ids=["middle gone", "last gone", "swapped", "first cut", "index cut", "last cut", "another",
         "foreign"],
)  # fmt: skip
def test_damage_between_files_is_found_and_told(
    rotated: Path,
    signer: Signer,
    tmp_path: Path,
    damage: Callable[[tuple[Path, ...]], None],
    expected: str,
):
    files = parts_of(rotated)
    damage(files)
    found = verify_file(rotated, [signer.public])
    assert not found.intact
    assert not found.authentic
    assert expected in kinds(found), [str(one) for one in found.findings]
    assert any(one.file or "audit." in one.text for one in found.findings)
    if damage is INDEX_CUT:
        return
    # What else reads a log tells that something is missing, too, and saves the rest.
    reader = LogReader(rotated)
    list(reader.messages())
    assert reader.damage
    assert [one for one in scan_log(rotated) if isinstance(one, Broken | Cut)]
    out = tmp_path / "out.mcap"
    recovery = recover_file(rotated, out, 1)
    assert recovery.damage
    assert recovery.messages == sum(isinstance(one, Recorded) for one in scan_log(rotated))
    assert verify_file(out).messages == recovery.messages


def test_a_whole_log_of_several_files_becomes_one(rotated: Path, tmp_path: Path):
    recovery = recover_file(rotated, tmp_path / "out.mcap", 1)
    assert (recovery.damage, recovery.messages) == ((), 3 * TICKS)
    assert verify_file(tmp_path / "out.mcap").intact
    assert ticks(tmp_path / "out.mcap") == list(range(TICKS))


def test_the_end_of_a_killed_recorders_file_can_not_be_cut_later(
    killed: tuple[Path, AuditLog, Recording],
):
    path, log, recording = killed
    log.close("closed", recording.now_ns)
    assert verify_file(path).intact
    os.truncate(path, path.stat().st_size - 3000)
    found = verify_file(path)
    assert "audit.2.mcap goes on after" in " ".join(map(str, found.findings))
    assert found.chained < 60


def test_a_later_file_alone_is_no_log(rotated: Path, tmp_path: Path):
    alone = tmp_path / "alone.mcap"
    shutil.copy(parts_of(rotated)[2], alone)
    found = verify_file(alone)
    assert kinds(found) == {"parts"}
    assert "this is part 3" in found.findings[0].text


@pytest.mark.parametrize("how", ["head", "file", "no json"])
def test_a_manifest_that_lies_is_told(rotated: Path, how: str):
    path = rotated.with_suffix(".manifest.json")
    told = json.loads(path.read_text())
    if how == "head":
        told["parts"][1]["head"] = "ab" * 32
    elif how == "file":
        told["parts"].append(told["parts"][0] | {"file": "audit.99.mcap"})
    path.write_text(json.dumps(told) if how != "no json" else "{")
    found = verify_file(rotated)
    assert kinds(found) == {"parts"}
    path.unlink()
    assert verify_file(rotated).intact


def test_parts_are_told_by_their_names_alone(tmp_path: Path):
    for name in ("audit.mcap", "audit.2.mcap", "audit.10.mcap", "audit.recovered.mcap",
                 "audit.02.mcap", "other.3.mcap", "audit.2.mcap.new"):  # fmt: skip
        (tmp_path / name).touch()
    assert [one.name for one in parts_of(tmp_path / "audit.mcap")][-1] == "audit.10.mcap"
    assert len(parts_of(tmp_path / "audit.mcap")) == 10
    assert parts_of(tmp_path / "audit.2.mcap") == (tmp_path / "audit.2.mcap",)
    assert parts_of(tmp_path / "nowhere" / "audit.mcap") == (tmp_path / "nowhere" / "audit.mcap",)
