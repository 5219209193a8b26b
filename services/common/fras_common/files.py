"""Files: read no further than they may be long, written whole or not at all; whose they are."""

import errno
import os
import stat
from pathlib import Path
from typing import Final

TEXT_BYTES: Final = 4 * 2**20
"""Of a scenario, a process table, or the manifest of a log."""
CONTEXTS_BYTES: Final = 256 * 2**20
"""Of a file of contexts to plan from."""


def read_at_most(path: Path, most_bytes: int) -> bytes:
    """Return the content of a file.

    Raises
    ------
    OSError
        It can't be read, or is longer than `most_bytes`, as a device without an end is.
    """
    with path.open("rb") as file:
        content = file.read(most_bytes + 1)
    if len(content) > most_bytes:
        text = f"{os.strerror(errno.EFBIG)}: more than {most_bytes} bytes"
        raise OSError(errno.EFBIG, text, str(path))
    return content


def write_whole(path: Path, content: bytes) -> None:
    """Write beside, then put in place: what stood there stays if it fails or is killed.

    Raises
    ------
    OSError
        It can't be written, as on a full disk.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.{os.getpid()}.new")
    try:
        beside.write_bytes(content)
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def data_folder() -> Path:
    """Return where this user's data are: `$XDG_DATA_HOME/fras`, or below `~/.local/share`.

    Raises
    ------
    RuntimeError
        Neither is known, as for a user whom no system knows.
    """
    base = os.environ.get("XDG_DATA_HOME")
    return (Path(base) if base else Path.home() / ".local" / "share") / "fras"


def is_private(path: Path) -> bool:
    """Whether nobody but its owner may use a file, or look into a folder."""
    return not path.stat().st_mode & (stat.S_IRWXG | stat.S_IRWXO)
