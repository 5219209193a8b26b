"""The stacks that run on this machine, one small file each: so that `fras stop` finds them.

`<cell>.json` is that of `fras up`, `<cell>.<pid>.json` one that `fras run` started for itself.
"""

import os
import re
import stat
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import psutil

from fras_common.errors import FrasError

CELL_NAME = re.compile(r"[A-Za-z0-9_-]+")
CLOCK_STEP_S = 3600.0


class NoStack(FrasError):
    """No stack runs in the cell."""


class SeveralStacks(FrasError):
    """More than one stack runs in the cell, and it is not clear which one is meant."""


class StackExists(FrasError):
    """A stack runs in the cell already."""


class BadRuntimeFolder(FrasError):
    """The folder of the records is not this user's alone. Attributes: ``path``."""


class BadCell(FrasError):
    """A cell's name that can't be part of a key or of a file's name."""


class StackRecord(msgspec.Struct, frozen=True, kw_only=True):
    """Who keeps a stack, and where it listens.

    Attributes
    ----------
    pid, created_s : int, float
        Process that keeps it; a reused process id has another creation time.
    keys : str
        Folder of its certificates; empty if it has none.
    """

    cell: str
    pid: int
    created_s: float
    connect: str
    log_dir: str
    keys: str = ""


def runtime_dir() -> Path:
    """Private folder for the records: `$XDG_RUNTIME_DIR/fras`, else one below the temp folder.

    Raises
    ------
    BadRuntimeFolder
        It is not this user's alone.
    """
    base = os.environ.get("XDG_RUNTIME_DIR")
    folder = Path(base) / "fras" if base else Path(tempfile.gettempdir()) / f"fras-{os.getuid()}"
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    told = folder.lstat()
    if not stat.S_ISDIR(told.st_mode) or told.st_uid != os.getuid() or told.st_mode & 0o022:
        raise BadRuntimeFolder(
            f"{folder}: somebody else may write here, and could send a stop elsewhere: remove it, "
            "or set XDG_RUNTIME_DIR to a folder of your own",
            path=folder,
        )
    return folder


def record_path(cell: str) -> Path:
    """File of a cell's record.

    Raises
    ------
    BadCell
        If the name holds anything but letters, digits, dots, dashes and underscores.
    """
    if not CELL_NAME.fullmatch(cell):
        raise BadCell(
            f"cell {cell!r}: letters, digits, dashes and underscores are allowed", cell=cell
        )
    return runtime_dir() / f"{cell}.json"


def is_alive(record: StackRecord) -> bool:
    """Whether the process of the record runs, and is not another one with a reused id."""
    try:
        created_s = psutil.Process(record.pid).create_time()
    except psutil.NoSuchProcess:
        return False
    # Creation times count from the boot time, which moves when the clock is set.
    return abs(created_s - record.created_s) < CLOCK_STEP_S


def find(cell: str) -> StackRecord | None:
    """Find the record of a running stack; one whose process is gone is removed."""
    return _read(record_path(cell))


def all_of(cell: str) -> list[StackRecord]:
    """Find the records of all running stacks of a cell, that of `fras up` first."""
    paths = [record_path(cell), *sorted(runtime_dir().glob(f"{cell}.*.json"))]
    return [record for path in paths if (record := _read(path)) is not None]


def everywhere() -> list[StackRecord]:
    """Find the records of all running stacks of this machine."""
    return [record for path in sorted(runtime_dir().glob("*.json")) if (record := _read(path))]


def _read(path: Path) -> StackRecord | None:
    try:
        record = msgspec.json.decode(path.read_bytes(), type=StackRecord)
    except FileNotFoundError:
        return None
    except msgspec.DecodeError:
        path.unlink(missing_ok=True)
        return None
    if not is_alive(record):
        path.unlink(missing_ok=True)
        return None
    return record


def require(cell: str) -> StackRecord:
    """Find the record of a running stack.

    Raises
    ------
    NoStack
        With the command that starts one.
    """
    record = find(cell)
    if record is None:
        raise _none(cell)
    return record


def require_any(cell: str) -> list[StackRecord]:
    """Find the records of all running stacks of a cell.

    Raises
    ------
    NoStack
        There is none.
    """
    records = all_of(cell)
    if not records:
        raise _none(cell)
    return records


def require_one(cell: str, connect: str | None = None) -> StackRecord:
    """Find the record of the one stack of a cell, or of that at `connect`.

    Raises
    ------
    NoStack
        There is none.
    SeveralStacks
        There are several.
    """
    records = [one for one in require_any(cell) if connect in (None, one.connect)]
    if not records:
        raise NoStack(f"no stack of cell {cell!r} at {connect} was started on this machine")
    if len(records) > 1:
        places = ", ".join(record.connect for record in records)
        raise SeveralStacks(
            f"{len(records)} stacks run in cell {cell!r}: say which with --connect: {places}",
            places=places,
        )
    return records[0]


def _none(cell: str) -> NoStack:
    return NoStack(f"no stack runs in cell {cell!r}: start one with `fras up --cell {cell}`")


def keep(cell: str, connect: str, log_dir: Path, keys: Path | None = None) -> StackRecord:
    """Record that this process keeps a stack.

    Raises
    ------
    StackExists
        If another process keeps one in this cell.
    """
    other = find(cell)
    if other is not None:
        raise StackExists(
            f"cell {cell!r} has a stack already (pid {other.pid}, {other.connect}): "
            f"stop it with `fras down --cell {cell}` or choose another --cell",
            pid=other.pid,
        )
    record = _of_this_process(cell, connect, log_dir, keys)
    path = record_path(cell)
    temporary = path.with_suffix(f".{record.pid}")
    temporary.write_bytes(msgspec.json.encode(record))
    try:
        # Unlike a rename this fails if somebody was quicker.
        path.hardlink_to(temporary)
    except FileExistsError as error:
        raise StackExists(f"cell {cell!r}: another stack is just starting", pid=0) from error
    finally:
        temporary.unlink()
    return record


def _of_this_process(cell: str, connect: str, log_dir: Path, keys: Path | None) -> StackRecord:
    me = psutil.Process()
    return StackRecord(
        cell=cell,
        pid=me.pid,
        created_s=me.create_time(),
        connect=connect,
        log_dir=str(log_dir.resolve()),
        keys=str(keys.resolve()) if keys is not None else "",
    )


@contextmanager
def noted(cell: str, connect: str, log_dir: Path, keys: Path | None = None) -> Generator[None]:
    """Record, within the block, that this process runs a stack for itself."""
    record = _of_this_process(cell, connect, log_dir, keys)
    path = record_path(cell).with_suffix(f".{record.pid}.json")
    path.write_bytes(msgspec.json.encode(record))
    try:
        yield
    finally:
        path.unlink(missing_ok=True)


def forget(record: StackRecord) -> None:
    """Remove this record, if it is still the cell's."""
    if find(record.cell) == record:
        record_path(record.cell).unlink(missing_ok=True)
