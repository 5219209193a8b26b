"""Files from elsewhere, read no further than they may be long."""

import errno
import os
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
