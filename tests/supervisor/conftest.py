"""Stacks of small child processes, and a way to wait for conditions."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Protocol

import psutil
import pytest

from fras_supervisor import Stack, free_port
from fras_supervisor.table import PLACEHOLDERS, parse_table

CHILD = Path(__file__).with_name("supervised_child.py")


class MakeStack(Protocol):
    def __call__(self, rows: dict[str, dict[str, Any]], **options: Any) -> Stack: ...


@pytest.fixture
def eventually() -> Callable[[Callable[[], Any]], Any]:
    """Waits for a condition and gives its value; fails after 15 s."""

    def wait(condition: Callable[[], Any]) -> Any:
        deadline = time.monotonic() + 15
        while not (value := condition()):
            assert time.monotonic() < deadline, "the condition did not come true"
            time.sleep(0.005)
        return value

    return wait


@pytest.fixture
def gone() -> Callable[[int], bool]:
    """Tells whether a process is dead (an init that does not reap leaves its zombie)."""

    def check(pid: int) -> bool:
        try:
            return psutil.Process(pid).status() == psutil.STATUS_ZOMBIE
        except psutil.NoSuchProcess:
            return True

    return check


@pytest.fixture
def tokens(tmp_path: Path) -> Callable[[], set[str]]:
    """The liveliness tokens of the children that live."""

    def lives(name: str) -> bool:
        pid = int((tmp_path / f"pid.{name}").read_text())
        return psutil.pid_exists(pid) and psutil.Process(pid).status() != psutil.STATUS_ZOMBIE

    def alive() -> set[str]:
        notes = [path.name.split(".", 1) for path in tmp_path.glob("*.*")]
        return {
            f"{kind}/{name}" for kind, name in notes if kind in ("alive", "ready") and lives(name)
        }

    return alive


@pytest.fixture
def write_table(tmp_path: Path) -> Callable[[dict[str, dict[str, Any]]], str]:
    """Writes the TOML of a table; `does` in a row is what the child's arguments say."""

    def write(rows: dict[str, dict[str, Any]]) -> str:
        text = ""
        for name, row in rows.items():
            command = ["{python}", "-I", "-S", str(CHILD), "{name}", str(tmp_path)]
            settings = {"command": command + row.get("does", []), "stop_timeout_s": 10, **row}
            settings.pop("does", None)
            lines = "".join(f"{key} = {value!r}\n" for key, value in settings.items())
            text += f"[process.{name}]\n{lines}\n"
        return text

    return write


@pytest.fixture
def make_stack(
    tmp_path: Path,
    tokens: Callable[[], set[str]],
    write_table: Callable[[dict[str, dict[str, Any]]], str],
) -> Iterator[MakeStack]:
    """Makes stacks of children and stops them at the end of the test."""
    stacks: list[Stack] = []

    def make(rows: dict[str, dict[str, Any]], **options: Any) -> Stack:
        values = options.get("values", {})
        table = parse_table(write_table(rows), "test.toml", {*PLACEHOLDERS, *values})
        connect = options.pop("connect", None) or f"tcp/127.0.0.1:{free_port()}"
        alive = options.pop("alive", tokens)
        stack = Stack(table, "test", connect, tmp_path / "logs", alive, **options)
        stacks.append(stack)
        return stack

    yield make
    for stack in stacks:
        stack.stop()


@pytest.fixture
def ended(tmp_path: Path) -> Callable[[], list[str]]:
    """What the children wrote when they ended, in that order, as `name cause`."""

    def read() -> list[str]:
        journal = tmp_path / "ended"
        return journal.read_text().splitlines() if journal.exists() else []

    return read
