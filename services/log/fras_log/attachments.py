"""The files that a log holds besides its messages: which there are, and the rules among them."""

from collections.abc import Mapping
from pathlib import Path, PurePosixPath

from fras_common.errors import FrasError
from fras_log.events import Attached, Recorded
from fras_log.scan import scan

RULES = "asp/"
"""Before the names of the rule files by which the planner decided."""


class BadAttachment(FrasError):
    """An attachment that is not what its name promises. Attributes: ``path``, ``name``."""


class InTheWay(FrasError):
    """A file that there is already; none is written over. Attributes: ``path``."""


def read_attachments(path: Path) -> dict[str, bytes]:
    """Return what a log holds before its first message, by name, as far as it is undamaged.

    The chain vouches for these alone, and for the first of each name. Reading ends with them.

    Raises
    ------
    NoSuchLog, NotAnMcap
    """
    found: dict[str, bytes] = {}
    for event in scan(path):
        if isinstance(event, Recorded):
            break
        if isinstance(event, Attached):
            found.setdefault(event.name, event.content)
    return found


def rules_in(attachments: Mapping[str, bytes], path: Path) -> dict[str, str]:
    """Return the rule files among them, text by path below `asp/`; none in an older log.

    Raises
    ------
    BadAttachment
        One is no UTF-8 text.
    """
    rules: dict[str, str] = {}
    for name, content in attachments.items():
        if not name.startswith(RULES):
            continue
        try:
            rules[name.removeprefix(RULES)] = content.decode()
        except UnicodeDecodeError as error:
            raise BadAttachment(
                f"{path}: its attachment {name!r} is no text: {error}", path=path, name=name
            ) from error
    return rules


def write_attachments(attachments: Mapping[str, bytes], path: Path, out: Path) -> list[Path]:
    """Write attachments below a folder, all of them or none.

    Parameters
    ----------
    attachments : mapping of name to bytes
    path : Path
        The log, for messages.
    out : Path
        Made if there is none; what is in it stays.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    BadAttachment
        A name leads out of the folder, or can't be a file's.
    InTheWay
        A file of that name is there.
    """
    places = {out.joinpath(_inside(name, path)): data for name, data in attachments.items()}
    for place in places:
        if place.exists() or place.is_symlink():
            text = f"{place} exists and is not written over: give another --out"
            raise InTheWay(text, path=place)
        if not places.keys().isdisjoint(place.parents):
            raise _unfit(place.relative_to(out).as_posix(), path)
    for place in places:
        place.parent.mkdir(parents=True, exist_ok=True)
    for place, data in places.items():
        with place.open("xb") as file:
            file.write(data)
    return list(places)


def _inside(name: str, path: Path) -> PurePosixPath:
    """Return a name as a path within a folder: whoever wrote the log chose it."""
    parts = name.split("/")
    if not name.isprintable() or "\\" in name or ":" in name or {"", ".", ".."} & set(parts):
        raise _unfit(name, path)
    return PurePosixPath(*parts)


def _unfit(name: str, path: Path) -> BadAttachment:
    return BadAttachment(
        f"{path}: its attachment {name!r} has no name that a file in a folder can have; "
        "nothing was written",
        path=path,
        name=name,
    )
