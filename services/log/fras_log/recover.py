"""What a damaged log still holds, as a whole log of its own; the damaged one is never written."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

from fras_common.bus import RawSample
from fras_common.codec import read_header
from fras_log.keys import Signer
from fras_log.names import CLOSED, METADATA, RECOVERED
from fras_log.scan import Attached, Broken, Recorded, Told, scan
from fras_log.verify import verify_file
from fras_log.writer import LogFile

__all__ = ["Recovery", "recover_file"]


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
        What was wrong with the old log, in its order.
    """

    path: Path
    messages: int
    chained: int
    last_tick: int
    damage: tuple[str, ...]


def recover_file(path: Path, out: Path, now_ns: int, signer: Signer | None = None) -> Recovery:
    """Write all that a log still holds into a new one.

    Parameters
    ----------
    path : Path
        The old log.
    out : Path
        Must not exist.
    now_ns : int
        Wall clock, for the attachments.
    signer : Signer, optional
        Signs the new log: who recovered it, not who recorded it.

    Raises
    ------
    NoSuchLog, NotAnMcap, ForeignLog, LogExists
    """
    opening: dict[str, str] = {}
    attachments: dict[str, bytes] = {}
    for event in scan(path):
        match event:
            case Told(name=name, content=content) if name == METADATA:
                opening = content
            case Attached(name=name, content=content):
                attachments[name] = content
            case Recorded():
                break  # what describes the log stands before its messages
            case _:
                pass
    chained = verify_file(path).chained
    original = json.dumps(opening, sort_keys=True)
    described = {name: value for name, value in opening.items() if name != "public_key"}
    log = LogFile(out, described, attachments, now_ns, signer)
    damage: list[str] = []
    last_tick = -1
    closing: dict[str, str] = {"reason": "recovered"}
    for event in scan(path):
        match event:
            case Recorded():
                sample = RawSample(event.topic, event.payload, event.encoding)
                log.write(sample, event.log_time)
                header = read_header(event.payload)
                last_tick = max(last_tick, header.tick if header is not None else -1)
            case Broken(offset=offset, text=text):
                damage.append(f"offset {offset}: {text}")
            case Told(name=name, content=content) if name == CLOSED:
                closing = {**content, "reason": f"recovered; {content.get('reason', '')}"}
            case _:
                pass
    log.add_metadata(
        RECOVERED,
        {
            "source": path.name,
            "source_sha256": _sha256(path),
            "chained": str(chained),
            "opening": original,
            "damage": "\n".join(damage),
        },
    )
    log.close({name: closing[name] for name in closing if name not in ("head", "signature")})
    return Recovery(out, log.messages, chained, last_tick, tuple(damage))


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
