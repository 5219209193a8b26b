"""The bytes of a file that someone else may write, cut or remove meanwhile."""

import os
import re
import stat
import zlib
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from fras_log.errors import NoSuchLog, NotAnMcap

_BLOCK = 4 * 2**20
_LEAST_BLOCK = 2**12
# Longer than anything that is searched for.
_OVERLAP = 64


class Source:
    """A file as long as it was when it was opened: what is written later is not looked at.

    It is read, not mapped: a mapped file that is cut meanwhile ends the process.

    Parameters
    ----------
    descriptor : int
        Open for reading.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self.size = os.fstat(descriptor).st_size

    def read(self, start: int, end: int) -> bytes:
        """Return the bytes from `start` to `end`, fewer if there are fewer."""
        end = min(end, self.size)
        pieces: list[bytes] = []
        while start < end:
            piece = os.pread(self._descriptor, end - start, start)
            if not piece:
                break
            pieces.append(piece)
            start += len(piece)
        return pieces[0] if len(pieces) == 1 else b"".join(pieces)

    def checksum(self, start: int, end: int) -> int:
        """CRC-32 of the bytes from `start` to `end`."""
        value = 0
        for block in range(start, end, _BLOCK):
            value = zlib.crc32(self.read(block, min(block + _BLOCK, end)), value)
        return value

    def find(self, pattern: re.Pattern[bytes], start: int) -> int:
        """Where the pattern is next, from `start` on; -1 if nowhere."""
        # It is mostly near: a large block for each of many would be read in vain.
        size = _LEAST_BLOCK
        while start < self.size:
            block = self.read(start, start + size + _OVERLAP)
            if found := pattern.search(block):
                return start + found.start()
            start += size
            size = min(2 * size, _BLOCK)
        return -1


def open_regular(path: Path, *, buffering: int = -1) -> BinaryIO:
    """Open a file, and nothing else, for reading.

    Raises
    ------
    NoSuchLog
        It can't be opened, or is no regular file.
    """
    try:
        # A pipe would wait here for someone who writes into it.
        if not stat.S_ISREG(path.stat().st_mode):
            raise NoSuchLog(path, "it is no regular file")
        return path.open("rb", buffering=buffering)
    except OSError as error:
        raise NoSuchLog(path, error.strerror or str(error)) from error


@contextmanager
def open_source(path: Path) -> Generator[Source]:
    """Open a file for reading alone.

    Raises
    ------
    NoSuchLog
        It can't be opened, or is no regular file.
    NotAnMcap
        It is empty.
    """
    with open_regular(path, buffering=0) as file:
        source = Source(file.fileno())
        if not source.size:
            raise NotAnMcap(path, "it is empty")
        yield source
