"""The children's output on a terminal: prefixed, coloured, and never in anybody's way."""

import os
import queue
import threading
from collections.abc import Sequence
from typing import Final, Self, TextIO

COLOURS: Final = (36, 32, 33, 35, 34, 96, 92, 93, 95, 94)
CLOSE_WAIT_S: Final = 1.0


class Console:
    """Writes lines as `sim      | text` from a thread of its own.

    A terminal can be slow or stopped (Ctrl-S). The log pumps must not wait for it, or a child
    would block in a print and the tick with it; so lines wait in a bounded queue, and those
    that don't fit are counted and left to the log files.

    Parameters
    ----------
    stream : TextIO
        Where to write.
    names : sequence of str
        All processes; sets the width of the prefix and each one's colour.
    colour : bool, optional
        Default: if the stream is a terminal and NO_COLOR is not set.
    capacity : int
        Lines that may wait.
    """

    def __init__(
        self,
        stream: TextIO,
        names: Sequence[str],
        *,
        colour: bool | None = None,
        capacity: int = 2_000,
    ) -> None:
        if colour is None:
            colour = stream.isatty() and not os.environ.get("NO_COLOR")
        width = max(map(len, names), default=0)
        self.fault: Exception | None = None
        self._stream = stream
        self._prefix = {
            name: f"\x1b[{COLOURS[index % len(COLOURS)]}m{name:<{width}} |\x1b[0m "
            if colour
            else f"{name:<{width}} | "
            for index, name in enumerate(names)
        }
        self._waiting: queue.Queue[str | None] = queue.Queue(capacity)
        self._dropped = 0
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._write_all, name="console", daemon=True)
        self._thread.start()

    def __call__(self, name: str, line: str) -> None:
        """Queue one line of a process; returns at once."""
        try:
            self._waiting.put_nowait(f"{self._prefix.get(name, f'{name} | ')}{line}\n")
        except queue.Full:
            with self._lock:
                self._dropped += 1

    def close(self) -> None:
        """Write what waits, for at most a second: a stopped terminal must not hold us up."""
        try:
            self._waiting.put(None, timeout=CLOSE_WAIT_S)
        except queue.Full:
            return
        self._thread.join(CLOSE_WAIT_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _write_all(self) -> None:
        while (text := self._waiting.get()) is not None:
            self._write(text + self._note_of_dropped())
        self._write(self._note_of_dropped())

    def _note_of_dropped(self) -> str:
        with self._lock:
            dropped, self._dropped = self._dropped, 0
        return f"[{dropped} lines not shown, the terminal is slow; see the logs]\n" * (dropped > 0)

    def _write(self, text: str) -> None:
        if self.fault is not None:
            return
        try:
            self._stream.write(text)
            self._stream.flush()
        except (OSError, ValueError) as error:
            # The terminal is gone. Nothing is lost, the files have it all; the stack goes on.
            self.fault = error
