"""A log with all its files as one sequence of events."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from fras_log.errors import NoSuchLog, NotAnMcap
from fras_log.events import Broken, Cut, Event, Recorded, Told
from fras_log.names import MESSAGES_BEFORE, METADATA, NEXT
from fras_log.parts import parts_of
from fras_log.scan import Progress, scan

__all__ = ["scan_log"]


def scan_log(path: Path, progress: Progress | None = None) -> Iterator[Event]:
    """Yield what a log holds, file by file; where messages are missing between them, it is told.

    Parameters
    ----------
    path : Path
        Of the first file.
    progress : callable, optional
        As for `scan`, for each file.

    Raises
    ------
    NoSuchLog, NotAnMcap
        The first file can't be read.
    """
    messages = number = 0
    following = ""
    # Looked for anew each time: a log that is still written may grow by a file meanwhile.
    while number < len(files := parts_of(path)):
        file, number, following = files[number], number + 1, ""
        told = number == 1
        try:
            for event in scan(file, progress):
                match event:
                    case Recorded():
                        messages += 1
                    case Broken(text=text) if len(files) > 1:
                        event = replace(event, text=f"{file.name}: {text}")
                    case Cut() if number < len(parts_of(path)):
                        # What the next file says of its end decides whether anything is missing.
                        continue
                    case Told(name=name, content=content) if name == METADATA and not told:
                        told = True
                        if content.get(MESSAGES_BEFORE) != str(messages):
                            text = (
                                f"{file.name}: it goes on after {content.get(MESSAGES_BEFORE)} "
                                f"messages, before it are {messages}"
                            )
                            yield Broken(event.offset, text)
                    case Told(content=content) if NEXT in content:
                        following = content[NEXT]
                    case _:
                        pass
                if isinstance(event, Recorded) and not told:
                    told = True
                    yield Broken(
                        event.offset, f"{file.name}: it does not say after what it goes on"
                    )
                yield event
        except (NoSuchLog, NotAnMcap) as error:
            if number == 1:
                raise
            yield Broken(0, str(error))
    if following:
        yield Broken(0, f"the next file, {following}, is missing")
