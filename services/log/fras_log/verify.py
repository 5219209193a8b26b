"""Whether a log is what was recorded: bytes, chain, signature, numbers, payloads, interlock."""

from collections.abc import Sequence
from pathlib import Path

from fras_log.content import Content
from fras_log.custody import Custody
from fras_log.errors import ForeignLog
from fras_log.events import Attached, Began, Broken, Cut, Ended, Recorded, Told
from fras_log.findings import Finding, Verification
from fras_log.keys import PublicKey
from fras_log.names import METADATA, PROFILE
from fras_log.scan import Progress, scan

__all__ = ["Finding", "Verification", "verify_file"]


def verify_file(
    path: Path,
    trusted: Sequence[PublicKey] = (),
    head: str = "",
    progress: Progress | None = None,
) -> Verification:
    """Verify a log.

    Parameters
    ----------
    path : Path
    trusted : sequence of PublicKey
        Whose signatures make it authentic.
    head : str
        Head that was noted elsewhere when the log was closed; empty: none was.
    progress : callable, optional
        Told how many bytes are read, of how many.

    Raises
    ------
    NoSuchLog, NotAnMcap, ForeignLog
        There is nothing to verify.
    """
    found = Verification()
    custody, content = Custody(found, trusted), Content(found)
    profile = PROFILE
    for event in scan(path, progress):
        match event:
            case Recorded():
                # Said early: a large file of someone else's need not be read to its end.
                if profile != PROFILE and not custody.opened:
                    break
                found.messages += 1
                custody.take_message(event, content.take(event))
            case Told(offset=offset, name=name, content=told):
                if name == METADATA and not custody.opened:
                    content.open(offset, told)
                custody.take_metadata(event)
            case Attached():
                custody.attach(event)
            case Broken(offset=offset, text=text, loses=loses):
                found.add(Finding("structure", text, offset))
                if loses:
                    custody.lose()
                    content.lose()
            case Cut(offset=offset, text=text):
                found.add(Finding("end", text, offset))
            case Began(profile=profile):
                custody.begin(event)
            case Ended():
                found.closed = custody.closing is not None
                if not found.closed:
                    found.add(Finding("structure", "the closing record is missing", event.offset))
    if profile != PROFILE and not custody.opened:
        raise ForeignLog(path, f"its profile is {profile!r}, not {PROFILE!r}")
    custody.finish(head)
    content.finish()
    return found
