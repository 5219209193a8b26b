"""A log of several files whose files are something else, or grow while they are read."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from fras_log import AuditLog, LogHeading, LogReader, NoSuchLog, recover_file, scan_log, verify_file
from fras_log.events import Broken, Cut, Recorded
from fras_log.parts import parts_of
from support.damage import OPENING, START_NS, Recording, verdict

PARTS = 4
PER_PART = 30


def rotate(log: AuditLog) -> None:
    log._rotate("size", START_NS)  # noqa: SLF001 - as when it has grown


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A whole log of four files."""
    path = tmp_path / "audit.mcap"
    log = AuditLog(path, LogHeading(OPENING), START_NS)
    recording = Recording(log)
    for part in range(PARTS):
        for tick in range(part * 10, part * 10 + 10):
            recording.tick(tick)
        if part < PARTS - 1:
            rotate(log)
    log.close("closed", START_NS)
    assert verify_file(path).intact
    return path


def folder(file: Path) -> None:
    file.mkdir()


def dangling(file: Path) -> None:
    file.symlink_to("nowhere")


def loop(file: Path) -> None:
    file.symlink_to(file.name)


@pytest.mark.parametrize(
    "put", [os.mkfifo, folder, dangling, loop, Path.touch, lambda _: None],
    ids=["pipe", "folder", "dangling", "loop", "empty", "nothing"],
)  # fmt: skip
def test_what_is_no_file_in_the_middle_is_told_and_the_rest_is_read(
    path: Path, put: Callable[[Path], None]
):
    file = path.with_name("audit.3.mcap")
    file.unlink()
    put(file)
    found = verify_file(path)
    assert any("audit.3.mcap" in str(one) for one in found.findings)
    assert found.messages == 3 * PER_PART
    reader = LogReader(path)
    assert len(list(reader.messages())) == 2 * PER_PART
    assert "audit.3.mcap" in reader.damage
    assert reader.closing == {}
    assert reader.size == sum(one.stat().st_size for one in parts_of(path) if one.is_file())
    events = list(scan_log(path))
    assert any(isinstance(one, Broken) and "audit.3.mcap" in one.text for one in events)
    assert sum(isinstance(one, Recorded) for one in events) == 3 * PER_PART
    assert recover_file(path, path.with_name("out.mcap"), 1).messages == 3 * PER_PART


@pytest.mark.parametrize("put", [os.mkfifo, folder, dangling, loop])
def test_what_is_no_file_at_the_beginning_is_refused(path: Path, put: Callable[[Path], None]):
    path.unlink()
    put(path)
    with pytest.raises(NoSuchLog):
        verify_file(path)
    with pytest.raises(NoSuchLog):
        list(LogReader(path).messages())
    with pytest.raises(NoSuchLog):
        list(scan_log(path))


def test_the_last_file_that_is_missing_is_told(path: Path):
    for number in (4, 3, 2):
        path.with_name(f"audit.{number}.mcap").unlink()
        told = f"audit.{number}.mcap, is missing"
        assert told in " ".join(map(str, verify_file(path).findings))
        assert [one.text for one in scan_log(path) if isinstance(one, Broken)] == [
            f"the next file, {told}"
        ]


def test_a_file_that_does_not_say_what_it_goes_on_from_is_told(path: Path):
    file = path.with_name("audit.3.mcap")
    file.unlink()
    other = AuditLog(path.with_name("other.mcap"), LogHeading(OPENING), START_NS)
    Recording(other).put("sa/verdict", verdict(1))
    other.close("closed", START_NS)
    whole = other.path.read_bytes()
    # The opening record of another name: as any other program's file.
    file.write_bytes(whole.replace(b"\x04\0\0\0fras", b"\x04\0\0\0else"))
    told = [one.text for one in scan_log(path) if isinstance(one, Broken)]
    assert any("audit.3.mcap" in one for one in told)


def test_a_log_that_grows_by_a_file_while_it_is_read_misses_none(tmp_path: Path):
    def grown(read: Callable[[Path, Callable[[], None]], object], name: str) -> object:
        path = tmp_path / name / "audit.mcap"
        log = AuditLog(path, LogHeading(OPENING), START_NS)
        recording = Recording(log)
        for tick in range(10):
            recording.tick(tick)
        log.flush(START_NS)
        rotated: list[int] = []

        def grow() -> None:
            if not rotated:
                rotated.append(1)
                rotate(log)
                for tick in range(10, 20):
                    recording.tick(tick)
                log.close("closed", START_NS)

        return read(path, grow)

    def with_reader(path: Path, grow: Callable[[], None]) -> tuple[int, str, int]:
        reader = LogReader(path)
        count = 0
        for _ in reader.messages():
            grow()
            count += 1
        return count, reader.damage, len(reader.files)

    def with_scan(path: Path, grow: Callable[[], None]) -> tuple[int, list[Broken | Cut]]:
        count, damage = 0, list[Broken | Cut]()
        for one in scan_log(path):
            grow()
            count += isinstance(one, Recorded)
            if isinstance(one, Broken | Cut):
                damage.append(one)
        return count, damage

    def with_verify(path: Path, grow: Callable[[], None]) -> tuple[int, list[str]]:
        found = verify_file(path, progress=lambda *_: grow())
        return found.messages, [str(one) for one in found.findings]

    assert grown(with_reader, "reader") == (60, "", 2)
    assert grown(with_scan, "scan") == (60, [])
    messages, findings = grown(with_verify, "verify")  # pyright: ignore
    assert (messages, findings) == (60, [])


def test_a_name_with_a_number_from_elsewhere_is_no_part(path: Path):
    for number in (2026, 20261127, 99999999999):
        path.with_name(f"audit.{number}.mcap").touch()
    assert len(parts_of(path)) == PARTS
    assert verify_file(path).intact


@pytest.mark.parametrize("put", [os.mkfifo, folder])
def test_a_manifest_that_is_no_file_is_told(path: Path, put: Callable[[Path], None]):
    manifest = path.with_suffix(".manifest.json")
    manifest.unlink()
    put(manifest)
    (finding,) = verify_file(path).findings
    assert "is no regular file" in str(finding)
