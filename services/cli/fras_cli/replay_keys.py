"""Keys of the terminal while a replay runs, and the line that says where it stands."""

import os
import select
import shutil
import sys
import termios
import threading
import tty
from collections.abc import Callable, Generator
from contextlib import contextmanager

from fras_common.messages import ReplayControl

RATES = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
LOOK_S = 0.2
RIGHT, LEFT = b"\x1b[C", b"\x1b[D"
HELP = (
    "space play/pause, n or → step, p or ← step back, + - rate, [ ] previous and next mark, q quit"
)


def command_of(key: bytes, playing: bool, rate: float) -> ReplayControl | None:
    """Return what a key means, given how the replay stands; None: nothing.

    Parameters
    ----------
    key : bytes
        As the terminal sends it.
    playing : bool
    rate : float
        0: as fast as possible.
    """
    match key:
        case b" ":
            return ReplayControl(command="pause" if playing else "play")
        case b"n" | b"\x1b[C":
            return ReplayControl(command="step")
        case b"p" | b"\x1b[D":
            return ReplayControl(command="back")
        case b"+" | b"=":
            faster = [one for one in RATES if one > rate]
            # 0 is as fast as possible, above which there is nothing.
            value = faster[0] if faster and rate else 0.0
            return ReplayControl(command="rate", value=value)
        case b"-":
            slower = [one for one in RATES if one < (rate or float("inf"))]
            return ReplayControl(command="rate", value=slower[-1] if slower else RATES[0])
        case b"]":
            return ReplayControl(command="next_mark")
        case b"[":
            return ReplayControl(command="previous_mark")
        case b"q" | b"\x04":
            return ReplayControl(command="stop")
        case _:
            return None


def split_keys(data: bytes) -> list[bytes]:
    """Split what was read at once into keys; the arrows are three bytes."""
    keys: list[bytes] = []
    while data:
        length = 3 if data[:3] in (RIGHT, LEFT) else 1
        keys.append(data[:length])
        data = data[length:]
    return keys


@contextmanager
def watched_terminal(on_key: Callable[[bytes], None], line: Callable[[], str]) -> Generator[None]:
    """Hand out keys and draw a line within the block, from a thread; nothing without a terminal."""
    if not sys.stdin.isatty():
        yield
        return
    fd = sys.stdin.fileno()
    before = termios.tcgetattr(fd)
    ended = threading.Event()
    watcher = threading.Thread(target=_watch, args=(fd, on_key, line, ended), name="keys")
    try:
        # Each key at once and unseen; Ctrl-C stays a signal.
        tty.setcbreak(fd)
        watcher.start()
        yield
    finally:
        ended.set()
        watcher.join()
        termios.tcsetattr(fd, termios.TCSADRAIN, before)


def _watch(
    fd: int, on_key: Callable[[bytes], None], line: Callable[[], str], ended: threading.Event
) -> None:
    draws = sys.stderr.isatty()
    while not ended.is_set():
        if select.select([fd], [], [], LOOK_S)[0]:
            if not (data := os.read(fd, 64)):
                return
            for key in split_keys(data):
                on_key(key)
        if draws:
            # Some terminals say that they have no columns; this then takes 80.
            width = shutil.get_terminal_size().columns
            sys.stderr.write(f"\r{line()[: width - 1]}\x1b[K")
            sys.stderr.flush()
    if draws:
        sys.stderr.write("\n")
