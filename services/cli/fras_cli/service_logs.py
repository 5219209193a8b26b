"""`fras logs`: what the processes of a stack have written, and write."""

import os
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import BinaryIO

from fras_cli import runtime
from fras_cli.run import EXIT_OK, caught_interrupts
from fras_common.errors import FrasError
from fras_supervisor import Console as Lines

POLL_S = 0.1


class NoLog(FrasError):
    """There is no log of that process."""


class LogTail:
    """The end of a rotated log, and what is added to it.

    Parameters
    ----------
    path : Path
        The newest file; its predecessor is `<path>.1`.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: BinaryIO | None = None
        self._partial = b""

    def last(self, count: int) -> list[str]:
        """Give the last complete lines; `new` goes on from there."""
        older = self._path.with_name(f"{self._path.name}.1")
        before = older.read_bytes().split(b"\n") if count and older.exists() else []
        lines = [*[one for one in before if one], *self._read()]
        return [_text(one) for one in lines[-count:]] if count else []

    def new(self) -> list[str]:
        """Give the lines that were completed since the last call, over a rotation, too."""
        lines = self._read()
        if self._file is not None and self._was_rotated():
            # What was written between that read and the rotation first.
            lines += self._read()
            self._file.close()
            self._file = None
            lines += self._read()
        return [_text(one) for one in lines]

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _was_rotated(self) -> bool:
        if self._file is None:
            return False
        try:
            return self._path.stat().st_ino != os.fstat(self._file.fileno()).st_ino
        except FileNotFoundError:
            return False

    def _read(self) -> list[bytes]:
        if self._file is None:
            if not self._path.exists():
                return []
            self._file = self._path.open("rb")
        *lines, self._partial = (self._partial + self._file.read()).split(b"\n")
        return lines


def show_logs(
    folder: Path, services: Sequence[str], count: int, follow: bool, stopping: Callable[[], bool]
) -> None:
    """Print the last lines of some logs, each after its process's name, and go on if asked to.

    Raises
    ------
    NoLog
        There is none of a process.
    """
    there = sorted(path.stem for path in folder.glob("*.log"))
    for service in services:
        if service not in there:
            raise NoLog(f"{folder} has no log of {service!r}; there are {', '.join(there)}")
    names = list(services) or there
    tails = {name: LogTail(folder / f"{name}.log") for name in names}
    with Lines(sys.stdout, names, capacity=max(2_000, 2 * count * len(names))) as lines:
        for name, tail in tails.items():
            for line in tail.last(count):
                lines(name, line)
        while follow and not stopping():
            for name, tail in tails.items():
                for line in tail.new():
                    lines(name, line)
            time.sleep(POLL_S)
    for tail in tails.values():
        tail.close()


def logs(
    cell: str,
    connect: str | None,
    folder: Path | None,
    services: Sequence[str],
    count: int,
    follow: bool,
) -> int:
    """Print the logs of the stack that runs in `cell`, or those in `folder`."""
    place = folder or Path(runtime.require_one(cell, connect).log_dir)
    with caught_interrupts() as interrupts:
        show_logs(place, services, count, follow, lambda: interrupts.count > 0)
    return EXIT_OK


def _text(line: bytes) -> str:
    return line.decode("utf-8", errors="replace")
