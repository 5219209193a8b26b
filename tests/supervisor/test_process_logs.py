import io
import os
import subprocess
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fras_supervisor import Console, LogDirUnusable
from fras_supervisor.logs import LogPump, RotatingFile


def contents(path: Path) -> list[bytes]:
    """All files of a log, oldest first."""
    aged = sorted(path.parent.glob(path.name + ".*"), reverse=True)
    return [one.read_bytes() for one in (*aged, path)]


def test_rotation_keeps_the_newest_whole_lines(tmp_path: Path) -> None:
    log = RotatingFile(tmp_path / "sim.log", max_bytes=100, keep=3)
    lines = [b"line %02d\n" % index for index in range(100)]
    log.write(b"".join(lines[:50]))
    for line in lines[50:]:
        log.write(line)
    log.close()
    files = contents(log.path)
    assert len(files) == 3
    assert all(len(one) <= 100 and one.endswith(b"\n") for one in files)
    kept = b"".join(files)
    assert b"".join(lines).endswith(kept)
    assert len(kept) > 200


@settings(max_examples=40)
@given(st.lists(st.binary(max_size=60), max_size=30), st.integers(1, 40))
def test_no_byte_is_lost_or_moved(
    tmp_path_factory: pytest.TempPathFactory, chunks: list[bytes], max_bytes: int
) -> None:
    log = RotatingFile(tmp_path_factory.mktemp("log") / "x.log", max_bytes, keep=2)
    for chunk in chunks:
        log.write(chunk)
    log.close()
    files = contents(log.path)
    assert b"".join(chunks).endswith(b"".join(files))
    assert all(len(one) <= max_bytes for one in files)
    if len(files) == 1:
        assert files[0] == b"".join(chunks)


def test_log_is_appended_to_at_a_restart(tmp_path: Path) -> None:
    for text in (b"one\n", b"two\n"):
        log = RotatingFile(tmp_path / "sim.log")
        log.write(text)
        log.close()
    assert (tmp_path / "sim.log").read_bytes() == b"one\ntwo\n"


def test_what_the_disk_refuses_is_counted_and_noted(tmp_path: Path) -> None:
    obstacle = tmp_path / "sim.log.1"
    (obstacle / "full").mkdir(parents=True)
    log = RotatingFile(tmp_path / "sim.log", max_bytes=60, keep=2)
    log.write(b"a" * 59 + b"\n")
    log.write(b"lost\n")
    assert log.lost_bytes == 5
    (obstacle / "full").rmdir()
    obstacle.rmdir()
    log.write(b"back\n")
    log.close()
    assert log.path.read_bytes() == b"[supervisor] 5 bytes were lost here\nback\n"


def test_log_goes_on_after_its_folder_was_away_at_a_rotation(tmp_path: Path) -> None:
    folder = tmp_path / "logs"
    folder.mkdir()
    log = RotatingFile(folder / "sim.log", max_bytes=60, keep=2)
    log.write(b"a" * 59 + b"\n")
    away = folder.rename(tmp_path / "away")
    log.write(b"lost\n")
    log.write(b"lost\n")
    away.rename(folder)
    log.write(b"back\n")
    log.close()
    assert log.lost_bytes == 10
    assert b"".join(contents(log.path)).endswith(b"a\n[supervisor] 10 bytes were lost here\nback\n")


def test_full_disk_is_no_reason_to_stop(tmp_path: Path) -> None:
    (tmp_path / "sim.log").symlink_to("/dev/full")
    log = RotatingFile(tmp_path / "sim.log")
    log.write(b"text\n")
    log.close()
    assert log.lost_bytes == 5


def test_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogDirUnusable, match="missing") as caught:
        RotatingFile(tmp_path / "missing" / "sim.log")
    assert caught.value.path == tmp_path / "missing"


def pump_through(tmp_path: Path, data: bytes, **options: Any) -> tuple[LogPump, list[str]]:
    heard: list[str] = []
    read, write = os.pipe()
    log = RotatingFile(tmp_path / "sim.log")
    pump = LogPump("sim", read, log, lambda _, line: heard.append(line), **options)
    os.write(write, data)
    os.close(write)
    pump.finish()
    return pump, heard


def test_pump_keeps_the_last_lines_and_echoes_all(tmp_path: Path) -> None:
    text = "".join(f"{index}\r\n" for index in range(30)) + "\u00fcnfinished"
    pump, heard = pump_through(tmp_path, text.encode() + b"\xff", keep_lines=3)
    assert pump.last_lines() == ("28", "29", "\u00fcnfinished\ufffd")
    assert heard == [*map(str, range(30)), "\u00fcnfinished\ufffd"]
    assert (tmp_path / "sim.log").read_bytes() == text.encode() + b"\xff"


def test_endless_line_does_not_fill_the_memory(tmp_path: Path) -> None:
    pump, heard = pump_through(tmp_path, b"x" * 60_000)
    assert "".join(heard) == "x" * 60_000
    assert max(map(len, pump.last_lines())) <= 8_192


def test_pump_ends_though_a_stray_process_holds_the_pipe(tmp_path: Path) -> None:
    read, write = os.pipe()
    pump = LogPump("sim", read, RotatingFile(tmp_path / "sim.log"), None)
    os.write(write, b"last words\n")
    pump.finish()
    os.close(write)
    assert pump.last_lines() == ("last words",)


def test_pump_ends_though_a_stray_process_never_stops_writing(
    tmp_path: Path, eventually: Callable[[Callable[[], Any]], Any]
) -> None:
    read, write = os.pipe()
    with subprocess.Popen(["yes"], stdout=write) as stray:
        os.close(write)
        pump = LogPump("sim", read, RotatingFile(tmp_path / "sim.log"), None)
        eventually(lambda: len(pump.last_lines()) > 1)
        pump.finish()
        stray.wait(10)  # nobody reads the pipe any more
    assert pump.last_lines()[-2] == "y"


def test_console_prefixes_and_colours() -> None:
    plain, coloured = io.StringIO(), io.StringIO()
    with Console(plain, ["sim", "planner"]) as console:
        console("sim", "one")
        console("planner", "two")
    assert plain.getvalue() == "sim     | one\nplanner | two\n"
    with Console(coloured, ["sim"], colour=True) as console:
        console("sim", "one")
    assert coloured.getvalue() == "\x1b[36msim |\x1b[0m one\n"


class StuckTerminal(io.StringIO):
    """Does not take a line until it is let go."""

    def __init__(self) -> None:
        super().__init__()
        self.asked = threading.Event()
        self.go_on = threading.Event()

    def write(self, text: str, /) -> int:
        self.asked.set()
        self.go_on.wait(10)
        return super().write(text)


def test_stuck_terminal_holds_nobody_up_and_the_gap_is_said() -> None:
    terminal = StuckTerminal()
    console = Console(terminal, ["sim"], capacity=2)
    console("sim", "0")
    assert terminal.asked.wait(10)
    for index in range(1, 10):
        console("sim", str(index))
    terminal.go_on.set()
    console.close()
    assert "sim | 2\n" in terminal.getvalue()
    assert "[7 lines not shown" in terminal.getvalue()
    assert "sim | 9\n" not in terminal.getvalue()


class GoneTerminal(io.StringIO):
    def write(self, text: str, /) -> int:
        raise BrokenPipeError


def test_terminal_that_is_gone_is_remembered(eventually: Callable[[Any], Any]) -> None:
    with Console(GoneTerminal(), ["sim"]) as console:
        console("sim", "one")
        console("sim", "two")
    assert isinstance(console.fault, BrokenPipeError)
