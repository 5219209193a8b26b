"""The files that an export writes: where they go, when they are refused, how they appear."""

import os
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path

from fras_common.errors import FrasError


class Format(StrEnum):
    """What can be written, by the ending of its name."""

    FOXGLOVE = ".foxglove.mcap"
    RERUN = ".rrd"


class OutputExists(FrasError):
    """A file is in the way, and is not to be overwritten."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            f"{path} exists: give another --out, or --force to overwrite it", path=path
        )


class OutputIsLog(FrasError):
    """The log itself was named as the file to write."""

    def __init__(self, path: Path) -> None:
        super().__init__(f"{path} is the log: it is never written, give another --out", path=path)


class OutputUnwritable(FrasError):
    """A file can't be written to its end."""

    def __init__(self, problem: str) -> None:
        super().__init__(f"the export can't be written: {problem}", problem=problem)


class NothingToExport(FrasError):
    """The log holds nothing of its trial that a viewer could show."""

    def __init__(self, path: Path, damage: str) -> None:
        why = f" ({damage})" if damage else ""
        super().__init__(f"{path}: holds nothing of its trial to show{why}", path=path)


def check_outputs(log: Path, outputs: Iterable[Path], overwrite: bool) -> None:
    """Refuse what must not be written, before anything is.

    Raises
    ------
    OutputIsLog, OutputExists
    """
    for path in outputs:
        if path.exists() and log.exists() and path.samefile(log):
            raise OutputIsLog(path)
        if path.exists() and not overwrite:
            raise OutputExists(path)


@contextmanager
def appearing(path: Path) -> Generator[Path]:
    """Give a place to write to; the file appears at `path` when the block ends well, or not."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
