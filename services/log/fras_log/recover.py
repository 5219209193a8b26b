"""What a damaged log still holds, as a whole log of its own; the damaged one is never written."""

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path

from fras_common.codec import read_header
from fras_log.errors import ForeignLog
from fras_log.events import Attached, Began, Broken, Cut, Recorded, Told
from fras_log.keys import Signer
from fras_log.names import BESIDE, CHECKPOINT, CLOSED, METADATA, NEXT, PROFILE, RECOVERED
from fras_log.parts import parts_of
from fras_log.pieces import scan_log
from fras_log.scan import Progress, scan
from fras_log.verify import verify_file
from fras_log.writer import LogFile

__all__ = ["Recovery", "recover_file"]

# What the new log's own closing record says itself.
_OWN = ("head", "messages", "signature", NEXT)


@dataclass(frozen=True)
class Recovery:
    """What came back.

    Attributes
    ----------
    path : Path
        The new log.
    messages : int
        How many it holds.
    chained : int
        For how many of them, from the first, the old log's chain vouches.
    last_tick : int
        The last of any message, -1 if none has one.
    damage : tuple of str
        What was wrong with the old log's bytes, in its order.
    """

    path: Path
    messages: int
    chained: int
    last_tick: int
    damage: tuple[str, ...]


@dataclass
class _Beginning:
    """What a log says before its messages."""

    opening: dict[str, str] = field(default_factory=dict[str, str])
    attachments: dict[str, bytes] = field(default_factory=dict[str, bytes])


def recover_file(
    path: Path,
    out: Path,
    now_ns: int,
    signer: Signer | None = None,
    progress: Progress | None = None,
) -> Recovery:
    """Write all that a log still holds into a new one.

    Parameters
    ----------
    path : Path
        The old log, its first file.
    out : Path
        Must not exist.
    now_ns : int
        Wall clock, for the attachments.
    signer : Signer, optional
        Signs the new log: who recovered it, not who recorded it.
    progress : callable, optional
        Told how many bytes are read, of how many; the file is read twice.

    Raises
    ------
    NoSuchLog, NotAnMcap, ForeignLog, LogExists
    """
    files = [file for file in parts_of(path) if file.is_file()]
    beginning = _read_beginning(path)
    chained = verify_file(path, progress=progress).chained
    described = {name: value for name, value in beginning.opening.items() if name != "public_key"}
    log = LogFile(out, described, beginning.attachments, now_ns, signer)
    damage: list[str] = []
    last_tick = -1
    closing: dict[str, str] = {"reason": "recovered"}
    for event in scan_log(path, progress):
        match event:
            case Recorded():
                log.append(*event[1:])
                header = read_header(event.payload)
                last_tick = max(last_tick, header.tick if header is not None else -1)
            case Broken(offset=offset, text=text) | Cut(offset=offset, text=text):
                damage.append(f"offset {offset}: {text}")
            case Told(name=name, content=content) if name == CLOSED:
                closing = {**content, "reason": f"recovered; {content.get('reason', '')}"}
            case Told(name=name, content=content) if name not in (METADATA, CHECKPOINT):
                log.add_metadata(f"{name} of {path.name}", content)
            case _:
                pass
    log.add_metadata(
        RECOVERED,
        {
            "source": ", ".join(file.name for file in files),
            "source_sha256": ", ".join(_sha256(file) for file in files),
            "chained": str(chained),
            "opening": json.dumps(beginning.opening, sort_keys=True),
            "damage": "\n".join(damage),
        },
    )
    log.close(
        {
            name: value
            for name, value in closing.items()
            if name not in _OWN and not name.startswith(BESIDE)
        }
    )
    return Recovery(out, log.messages, chained, last_tick, tuple(damage))


def _read_beginning(path: Path) -> _Beginning:
    found = _Beginning()
    profile = PROFILE
    for event in scan(path):
        match event:
            case Began(profile=profile):
                pass
            case Told(name=name, content=content) if name == METADATA:
                found.opening = found.opening or content
            case Attached(name=name, content=content):
                found.attachments.setdefault(name, content)
            case Recorded():
                break
            case _:
                pass
    if profile != PROFILE and not found.opening:
        raise ForeignLog(path, f"its profile is {profile!r}, not {PROFILE!r}")
    return found


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
