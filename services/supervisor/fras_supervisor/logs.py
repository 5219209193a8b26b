"""What a child writes: into a rotated file, to whoever listens, its last lines kept for errors."""

import os
import select
import threading
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Final

from fras_supervisor.errors import LogDirUnusable

CHUNK: Final = 65_536
LONGEST_LINE: Final = 8_192
DRAIN_LIMIT: Final = 1 << 20
MAX_BYTES: Final = 5_000_000
KEPT_FILES: Final = 3

Echo = Callable[[str, str], None]
"""Called with a process's name and one line of its output; must not block."""


class RotatingFile:
    """A file that starts anew at a size and keeps a few predecessors.

    Parameters
    ----------
    path : Path
        The newest file; older ones are `<path>.1`, `<path>.2`, ...
    max_bytes : int
        No file grows beyond it.
    keep : int
        Number of files, the newest one included.

    Attributes
    ----------
    lost_bytes : int
        Bytes that could not be written (disk full, ...), counted by the chunk; a note in the
        file says so as soon as it can be written again.

    Raises
    ------
    LogDirUnusable
        The file can't be opened.
    """

    def __init__(self, path: Path, max_bytes: int = MAX_BYTES, keep: int = KEPT_FILES) -> None:
        self.path = path
        self.lost_bytes = 0
        self._max_bytes = max_bytes
        self._keep = keep
        self._unreported = 0
        try:
            self._open()
        except OSError as error:
            raise LogDirUnusable(path.parent, str(error)) from error

    def write(self, data: bytes) -> None:
        """Append; never raises for want of space, since a child's pipe must be drained always."""
        try:
            if self._unreported:
                self._append(b"[supervisor] %d bytes were lost here\n" % self._unreported)
                self._unreported = 0
            self._append(data)
        except OSError:
            self.lost_bytes += len(data)
            self._unreported += len(data)

    def close(self) -> None:
        """Close the newest file."""
        self._file.close()

    def _append(self, data: bytes) -> None:
        if self._file.closed:  # it could not be opened again when it was rotated
            self._open()
        rest = memoryview(data)
        while rest:
            room = self._max_bytes - self._size
            if len(rest) <= room:
                cut = len(rest)
            else:
                # Cut between lines; a line that fits in no file is cut where the file ends.
                cut = bytes(rest[:room]).rfind(b"\n") + 1 or (room if self._size == 0 else 0)
            written = self._file.write(rest[:cut])
            self._size += written
            rest = rest[written:]
            if rest and written == cut:
                self._rotate()

    def _rotate(self) -> None:
        self._file.close()
        try:
            for age in range(self._keep - 1, 0, -1):
                younger = self._aged(age - 1)
                if younger.exists():
                    younger.replace(self._aged(age))
            if self._keep == 1:
                self.path.unlink()
        finally:
            self._open()

    def _aged(self, age: int) -> Path:
        return self.path if age == 0 else self.path.with_name(f"{self.path.name}.{age}")

    def _open(self) -> None:
        # Unbuffered: what a child wrote before it died is in the file, whatever happens to us.
        self._file = self.path.open("ab", buffering=0)
        self._size = self._file.tell()


class LogPump:
    """A thread that carries a child's output from its pipe to its log.

    Parameters
    ----------
    name : str
        The process's name.
    pipe : int
        File descriptor to read; the pump closes it.
    file : RotatingFile
        Where the output goes; the pump closes it.
    echo : callable, optional
        Also gets each line.
    keep_lines : int
        How many lines `last_lines` keeps.
    """

    def __init__(
        self, name: str, pipe: int, file: RotatingFile, echo: Echo | None, keep_lines: int = 20
    ) -> None:
        self.file = file
        self._name = name
        self._pipe = pipe
        self._echo = echo
        self._lines: deque[bytes] = deque(maxlen=keep_lines)
        self._partial = b""
        self._last_call = os.eventfd(0)
        self._thread = threading.Thread(target=self._carry, name=f"log-{name}", daemon=True)
        self._thread.start()

    def last_lines(self) -> tuple[str, ...]:
        """Give the newest lines, without their line ends; complete after `finish`."""
        lines = (*self._lines.copy(), self._partial)
        return tuple(_text(line) for line in lines if line)

    def finish(self) -> None:
        """Carry what is in the pipe, then close it, even if a stray grandchild holds it open."""
        if self._thread.is_alive():
            os.eventfd_write(self._last_call, 1)
        self._thread.join()
        if self._last_call >= 0:
            os.close(self._last_call)
            self._last_call = -1

    def _carry(self) -> None:
        poller = select.poll()
        poller.register(self._pipe, select.POLLIN)
        poller.register(self._last_call, select.POLLIN)
        allowance = DRAIN_LIMIT
        try:
            while allowance > 0:
                ready = {descriptor for descriptor, _ in poller.poll()}
                if self._pipe in ready:
                    chunk = os.read(self._pipe, CHUNK)
                    if not chunk:
                        break
                    self.file.write(chunk)
                    self._split(chunk)
                    if self._last_call in ready:
                        allowance -= len(chunk)
                else:
                    break
            if self._partial:
                self._emit(self._partial)
                self._partial = b""
        finally:
            os.close(self._pipe)
            self.file.close()

    def _split(self, chunk: bytes) -> None:
        *complete, partial = (self._partial + chunk).split(b"\n")
        for line in complete:
            self._emit(line)
        while len(partial) > LONGEST_LINE:
            self._emit(partial[:LONGEST_LINE])
            partial = partial[LONGEST_LINE:]
        self._partial = partial

    def _emit(self, line: bytes) -> None:
        self._lines.append(line[:LONGEST_LINE])
        if self._echo is not None:
            self._echo(self._name, _text(line[:LONGEST_LINE]))


def _text(line: bytes) -> str:
    return line.decode("utf-8", errors="replace").rstrip("\r")
