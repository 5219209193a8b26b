"""The stacks that `fras up` keeps running on this machine: one small file a cell."""

import os
import tempfile
from pathlib import Path

import msgspec
import psutil

from fras_common.errors import FrasError


class NoStack(FrasError):
    """No stack runs in the cell."""


class StackExists(FrasError):
    """A stack runs in the cell already."""


class StackRecord(msgspec.Struct, frozen=True, kw_only=True):
    """Who keeps a stack, and where it listens.

    Attributes
    ----------
    pid, created_s : int, float
        Process of `fras up`; a reused process id has another creation time.
    """

    cell: str
    pid: int
    created_s: float
    connect: str
    log_dir: str


def runtime_dir() -> Path:
    """Private folder for the records: `$XDG_RUNTIME_DIR/fras`, else one below the temp folder."""
    base = os.environ.get("XDG_RUNTIME_DIR")
    folder = Path(base) / "fras" if base else Path(tempfile.gettempdir()) / f"fras-{os.getuid()}"
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    return folder


def find(cell: str) -> StackRecord | None:
    """Find the record of a running stack; one whose process is gone is removed."""
    path = runtime_dir() / f"{cell}.json"
    try:
        record = msgspec.json.decode(path.read_bytes(), type=StackRecord)
    except FileNotFoundError:
        return None
    except msgspec.DecodeError:
        path.unlink(missing_ok=True)
        return None
    try:
        alive = psutil.Process(record.pid).create_time() == record.created_s
    except psutil.NoSuchProcess:
        alive = False
    if not alive:
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
        raise NoStack(f"no stack runs in cell {cell!r}: start one with `fras up --cell {cell}`")
    return record


def keep(cell: str, connect: str, log_dir: Path) -> StackRecord:
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
    me = psutil.Process()
    record = StackRecord(
        cell=cell,
        pid=me.pid,
        created_s=me.create_time(),
        connect=connect,
        log_dir=str(log_dir),
    )
    path = runtime_dir() / f"{cell}.json"
    temporary = path.with_suffix(f".{me.pid}")
    temporary.write_bytes(msgspec.json.encode(record))
    temporary.replace(path)
    return record


def forget(cell: str) -> None:
    """Remove the record of this cell."""
    (runtime_dir() / f"{cell}.json").unlink(missing_ok=True)
