"""Where a log's file ends: what the next one goes on from."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from fras_common.codec import HeaderFields, read_header
from fras_log.custody import Custody
from fras_log.events import Attached, Began, Broken, Recorded, Told
from fras_log.findings import Verification
from fras_log.names import METADATA
from fras_log.scan import scan

__all__ = ["OnHeader", "Tail", "read_opening", "read_tail"]

OnHeader = Callable[[str, HeaderFields], object]


@dataclass(frozen=True)
class Tail:
    """What a file comes to.

    Attributes
    ----------
    opening : dict of str to str
        What it says of itself.
    closing : dict of str to str
        Its last record; empty if it was never finished.
    messages : int
    head : str
        Of the chain after the last message that is whole, hexadecimal.
    """

    opening: dict[str, str]
    closing: dict[str, str]
    messages: int
    head: str


def read_opening(path: Path) -> dict[str, str]:
    """Read what a file says of itself before its first message; nothing if it says nothing.

    Raises
    ------
    NoSuchLog, NotAnMcap
    """
    for event in scan(path):
        match event:
            case Told(name=name, content=content) if name == METADATA:
                return content
            case Recorded():
                break
            case _:
                pass
    return {}


def read_tail(path: Path, on_header: OnHeader = lambda key, header: None) -> Tail:
    """Read a file to its end.

    Parameters
    ----------
    path : Path
    on_header : callable, optional
        Gets key and header of each message that has one.

    Raises
    ------
    NoSuchLog, NotAnMcap
    """
    custody = Custody(Verification(), ())
    for event in scan(path):
        match event:
            case Recorded():
                custody.take_message(event, -1)
                header = read_header(event.payload)
                if header is not None:
                    on_header(event.topic, header)
            case Told():
                custody.take_metadata(event)
            case Attached():
                custody.attach(event)
            case Broken():
                custody.lose()
            case Began():
                custody.begin(event)
            case _:
                pass
    custody.finish()
    opening, closing = custody.opening or {}, custody.closing or {}
    return Tail(opening, closing, custody.messages, custody.head)
