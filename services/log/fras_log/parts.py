"""A log in several files: how they are called, and what the manifest says of them."""

import os
import re
import stat
from pathlib import Path
from typing import Final

import msgspec

from fras_common.files import TEXT_BYTES, read_at_most
from fras_log.errors import NotAManifest

__all__ = ["Manifest", "Part", "manifest_path", "part_path", "parts_of", "read_manifest"]

MOST_PARTS: Final = 10_000
"""At 256 MiB a part, more than two terabytes."""
MOST_MISSING: Final = 1000
"""Between two parts; behind more, a name is taken for something else."""


class Part(msgspec.Struct, frozen=True, kw_only=True):
    """One file of a log, as it was finished.

    Attributes
    ----------
    file : str
        Its name, in the manifest's folder.
    messages, bytes : int
    head : str
        Of the chain after its last message, hexadecimal.
    began_ns, ended_ns : int
        Wall clock of the recorder.
    reason : str
        Why it ended: `size`, `time`, `killed`, `closed`, ...
    """

    file: str
    messages: int
    bytes: int
    head: str
    began_ns: int
    ended_ns: int
    reason: str


class Manifest(msgspec.Struct, frozen=True, kw_only=True):
    """The files of a log that are finished, in their order."""

    trial: str
    parts: tuple[Part, ...]

    def save(self, path: Path) -> None:
        """Write it, whole or not at all."""
        beside = path.with_name(path.name + ".new")
        # Not through a link that someone left there.
        beside.unlink(missing_ok=True)
        with beside.open("xb") as file:
            file.write(msgspec.json.format(msgspec.json.encode(self), indent=2))
            file.flush()
            # Else a power cut may leave an empty one in the place of what was good.
            os.fsync(file.fileno())
        os.replace(beside, path)


def part_path(first: Path, number: int) -> Path:
    """Return where the part of a number stands: `audit.mcap`, `audit.2.mcap`, ..."""
    return first if number == 1 else first.with_suffix(f".{number}{first.suffix}")


def manifest_path(first: Path) -> Path:
    """Return where the manifest of a log stands."""
    return first.with_suffix(".manifest.json")


def parts_of(path: Path) -> tuple[Path, ...]:
    """Return the files of a log in their order, for its first file; any other file stands alone.

    One that is missing between others is among them: whoever reads it says so. Behind more than
    `MOST_MISSING` that are, a name like `audit.2026.mcap` is taken for something else, and so is
    one with a number above `MOST_PARTS`.
    """
    name = re.compile(rf"{re.escape(path.stem)}\.([1-9][0-9]{{0,8}}){re.escape(path.suffix)}")
    try:
        beside = [name.fullmatch(one.name) for one in path.parent.iterdir()]
    except OSError:
        # Whoever opens the file says what is wrong.
        return (path,)
    last = 1
    for number in sorted(int(found[1]) for found in beside if found):
        if number > MOST_PARTS or number - last > MOST_MISSING:
            break
        last = number
    return tuple(part_path(path, number) for number in range(1, last + 1))


def read_manifest(path: Path) -> Manifest | None:
    """Read a manifest; None if there is none.

    Raises
    ------
    NotAManifest
        It can't be read as one.
    """
    try:
        # A pipe would wait here for someone who writes into it.
        if not stat.S_ISREG(path.stat().st_mode):
            raise NotAManifest(f"{path}: is no regular file", path=path)
        return msgspec.json.decode(read_at_most(path, TEXT_BYTES), type=Manifest)
    except FileNotFoundError:
        return None
    except (OSError, msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise NotAManifest(f"{path}: is no manifest of a log: {error}", path=path) from error
