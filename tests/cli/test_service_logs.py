"""The end of logs, and what is added to them, while a supervisor rotates them."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from fras_cli.service_logs import LogTail, NoLog, show_logs
from fras_supervisor.logs import RotatingFile


@pytest.fixture
def log(tmp_path: Path) -> Iterator[RotatingFile]:
    made = RotatingFile(tmp_path / "sim.log", max_bytes=100, keep=3)
    yield made
    made.close()


@pytest.fixture
def tail(log: RotatingFile) -> Iterator[LogTail]:
    made = LogTail(log.path)
    yield made
    made.close()


def written(log: RotatingFile, first: int, last: int) -> list[str]:
    lines = [f"line {number:04d}" for number in range(first, last)]
    for line in lines:
        log.write(f"{line}\n".encode())
    return lines


@pytest.mark.parametrize("count", [3, 12])
def test_the_last_lines_come_from_the_file_before_too(
    log: RotatingFile, tail: LogTail, count: int
) -> None:
    lines = written(log, 0, 15)  # ten in a file
    assert tail.last(count) == lines[-count:]
    assert tail.new() == []


def test_what_is_added_is_new_once_and_over_a_rotation(log: RotatingFile, tail: LogTail) -> None:
    written(log, 0, 5)
    assert tail.last(0) == []
    assert tail.new() == []
    seen: list[str] = []
    lines: list[str] = []
    for first in range(5, 45, 7):
        lines += written(log, first, first + 7)
        seen += tail.new()
    assert seen == lines


def test_a_line_is_shown_when_it_is_complete(log: RotatingFile, tail: LogTail) -> None:
    log.write(b"half of")
    assert tail.last(5) == []
    log.write(b" a line\nnext")
    assert tail.new() == ["half of a line"]


def test_a_log_that_comes_later_is_followed(tmp_path: Path) -> None:
    tail = LogTail(tmp_path / "late.log")
    assert tail.last(5) == tail.new() == []
    (tmp_path / "late.log").write_bytes(b"there\n")
    assert tail.new() == ["there"]
    tail.close()


def test_each_line_bears_its_process(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for name in ("sim", "motion"):
        (tmp_path / f"{name}.log").write_text(f"{name} here\n")
    show_logs(tmp_path, [], 5, follow=False, stopping=lambda: False)
    assert capfd.readouterr().out.splitlines() == ["motion | motion here", "sim    | sim here"]


def test_following_goes_on_until_told_to_stop(
    tmp_path: Path, log: RotatingFile, capfd: pytest.CaptureFixture[str]
) -> None:
    looks = iter(range(3))

    def stopping() -> bool:
        number = next(looks)
        log.write(f"{number}\n".encode())
        return number == 2

    show_logs(tmp_path, ["sim"], 5, follow=True, stopping=stopping)
    assert capfd.readouterr().out.splitlines() == ["sim | 0", "sim | 1"]


def test_a_process_without_a_log_is_named_with_those_there_are(tmp_path: Path) -> None:
    (tmp_path / "sim.log").write_text("x\n")
    with pytest.raises(NoLog, match=r"no log of 'sun'; there are sim"):
        show_logs(tmp_path, ["sun"], 5, follow=False, stopping=lambda: False)
