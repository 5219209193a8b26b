"""The log of a trial: one file, or several of which each goes on where the one before ended."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TypeVar

import msgspec

from fras_common.bus import RawSample
from fras_common.codec import HeaderFields
from fras_common.topics import may_be_lost
from fras_log.errors import ForeignLog, LogExists, NotAManifest
from fras_log.keys import Signer
from fras_log.names import (
    FINISHED,
    HEAD_BEFORE,
    KILLED,
    LOST_BEFORE,
    MESSAGES_BEFORE,
    NEXT,
    OPENED,
    PART,
    SENT_BEFORE,
)
from fras_log.parts import Manifest, Part, manifest_path, part_path, parts_of, read_manifest
from fras_log.streams import Ends, Streams
from fras_log.tail import OnHeader, read_opening, read_tail
from fras_log.writer import LogFile

__all__ = ["AuditLog", "LogHeading", "take_up"]

T = TypeVar("T")
# Files whose samples a publisher could still send again.
_READ_AGAIN = 2
# Of a file: the format numbers them with 16 bits, and anybody may make up keys.
CHANNELS = 10_000


@dataclass(frozen=True)
class LogHeading:
    """What each file of a log begins with, and how it is written.

    Attributes
    ----------
    metadata : mapping of str to str
        What the log says of itself.
    attachments : mapping of str to bytes
        Files that belong to the trial, by name.
    signer : Signer or None
    rotate_bytes : int
        The next file begins when one has grown to this size; 0: never.
    rotate_s : float
        And when one is so old; 0: never.
    fsync : bool
        Whether each flush waits until the disk has it.
    """

    metadata: Mapping[str, str]
    attachments: Mapping[str, bytes] = field(default_factory=dict[str, bytes])
    signer: Signer | None = None
    rotate_bytes: int = 0
    rotate_s: float = 0.0
    fsync: bool = False


@dataclass(frozen=True)
class _Before:
    """What the files before one hold."""

    began_ns: int = 0
    messages: int = 0
    lost: int = 0
    bytes: int = 0
    head: str = ""
    number: int = 0
    parts: tuple[Part, ...] = ()

    def as_metadata(self, sent: Ends) -> dict[str, str]:
        if not self.number:
            return {}
        return {
            PART: str(self.number + 1),
            HEAD_BEFORE: self.head,
            MESSAGES_BEFORE: str(self.messages),
            LOST_BEFORE: str(self.lost),
            SENT_BEFORE: msgspec.json.encode(sent).decode(),
        }


class AuditLog:
    """Writes the log of a trial; not thread-safe. See `take_up` for one that exists.

    Parameters
    ----------
    path : Path
        Of the first file; must not exist.
    heading : LogHeading
    now_ns : int
        Wall clock.

    Attributes
    ----------
    path : Path
        Of the first file.
    began_ns : int
        When that was begun.

    Raises
    ------
    LogExists
        If there is a file at `path`.
    """

    def __init__(
        self,
        path: Path,
        heading: LogHeading,
        now_ns: int,
        *,
        before: _Before = _Before(),
        streams: Streams | None = None,
    ) -> None:
        self.path = path
        self.began_ns = before.began_ns or now_ns
        self._heading = heading
        self._streams = streams or Streams()
        self._before = before
        self._file = self._begin(now_ns, before)
        self._file_began_ns = now_ns

    @property
    def messages(self) -> int:
        """How many there are in all files."""
        return self._before.messages + self._file.messages

    @property
    def lost(self) -> int:
        """How many never arrived, as far as this recorder can tell."""
        return self._before.lost + self._file.lost

    @property
    def bytes_written(self) -> int:
        """Size of all files."""
        return self._before.bytes + self._file.bytes_written

    @property
    def file(self) -> Path:
        """The file that is written now."""
        return self._file.path

    def write(self, sample: RawSample, arrival_ns: int) -> HeaderFields | None:
        """Append a sample, unless it is a copy; see `LogFile.write`."""
        header = self._file.write(sample, arrival_ns)
        if self._is_full():
            self._rotate("size", arrival_ns)
        return header

    def precedes(self, key: str, header: HeaderFields) -> bool:
        """Whether a sample was sent before the first one of its publisher that the log holds."""
        return self._streams.precedes(key, header)

    def flush(self, now_ns: int) -> None:
        """Hand all that was written to the operating system, and begin the next file if due."""
        self._file.flush()
        age_s = (now_ns - self._file_began_ns) / 1e9
        if self._is_full():
            self._rotate("size", now_ns)
        elif self._file.messages and 0 < self._heading.rotate_s <= age_s:
            self._rotate("time", now_ns)

    def close(self, reason: str, now_ns: int) -> None:
        """Finish the last file."""
        self._finish(reason)
        if self._before.number:
            self._save((*self._before.parts, self._part(reason, now_ns)))

    def abandon(self) -> None:
        """Let go of a file that can't be written any more; what was flushed stays readable."""
        self._file.abandon()

    # --- files ----------------------------------------------------------------------------

    def _begin(self, now_ns: int, before: _Before) -> LogFile:
        heading = self._heading
        return LogFile(
            part_path(self.path, before.number + 1),
            {**heading.metadata, OPENED: str(now_ns), **before.as_metadata(self._streams.ends)},
            heading.attachments,
            now_ns,
            heading.signer,
            fsync=heading.fsync,
            streams=self._streams,
        )

    def _is_full(self) -> bool:
        has_grown = 0 < self._heading.rotate_bytes <= self._file.bytes_written
        return has_grown or self._file.channels >= CHANNELS

    def _rotate(self, reason: str, now_ns: int) -> None:
        self._file.flush()
        old, before = self._file, self._before
        after = replace(
            before,
            began_ns=self.began_ns,
            messages=self.messages,
            lost=self.lost,
            head=old.head,
            number=before.number + 1,
        )
        # The next one first: if the disk has no place for it the old one says of none.
        file = self._begin(now_ns, after)
        try:
            self._finish(reason, {NEXT: file.path.name})
        except OSError:
            file.abandon()
            raise
        parts = (*before.parts, self._part(reason, now_ns))
        self._before = replace(after, bytes=before.bytes + old.bytes_written, parts=parts)
        self._file, self._file_began_ns = file, now_ns
        self._save(parts)

    def _finish(self, reason: str, more: Mapping[str, str] = MappingProxyType({})) -> None:
        self._file.close({"lost": str(self._file.lost), "reason": reason, **more})

    def _part(self, reason: str, now_ns: int) -> Part:
        file = self._file
        return Part(
            file=file.path.name,
            messages=file.messages,
            bytes=file.bytes_written,
            head=file.head,
            began_ns=self._file_began_ns,
            ended_ns=now_ns,
            reason=reason,
        )

    def _save(self, parts: tuple[Part, ...]) -> None:
        trial = self._heading.metadata.get("trial", "")
        Manifest(trial=trial, parts=parts).save(manifest_path(self.path))


def take_up(
    path: Path,
    heading: LogHeading,
    now_ns: int,
    on_header: OnHeader = lambda key, header: None,
) -> AuditLog:
    """Go on, in the next file, with a log that another recorder left unfinished.

    Parameters
    ----------
    path : Path
        Of the first file.
    heading : LogHeading
    now_ns : int
        Wall clock.
    on_header : callable, optional
        Gets key and header of each message of the last two files.

    Raises
    ------
    LogExists
        It is the log of something else, or it is finished.
    NoSuchLog, NotAnMcap, ForeignLog
        A file of it can't be read.
    """
    first = read_opening(path)
    metadata = heading.metadata
    if any(first.get(name) != metadata.get(name) for name in ("trial", "scenario")):
        raise _exists(path, "is the log of something else")
    files = parts_of(path)
    again = files[-_READ_AGAIN:]
    opening = first if again[0] == path else read_opening(again[0])
    # What earlier files hold is told there: a publisher that says little still caches all of it.
    streams = Streams(_told(again[0], opening, SENT_BEFORE, dict[str, dict[str, int]]) or {})
    lost = _told(again[0], opening, LOST_BEFORE, int) or 0

    def note(key: str, header: HeaderFields) -> None:
        nonlocal lost
        missing = streams.note(key, header)
        if missing and not may_be_lost(key):
            lost += missing
        on_header(key, header)

    for earlier in again[:-1]:
        read_tail(earlier, note)
    last, tail = files[-1], read_tail(files[-1], note)
    reason = tail.closing.get("reason", KILLED)
    if reason == FINISHED:
        raise _exists(path, "is finished")
    ended = Part(
        file=last.name,
        messages=tail.messages,
        bytes=last.stat().st_size,
        head=tail.head,
        began_ns=_told(last, tail.opening, OPENED, int) or 0,
        ended_ns=now_ns,
        reason=reason,
    )
    before = _Before(
        began_ns=_told(path, first, OPENED, int) or 0,
        messages=tail.messages + (_told(last, tail.opening, MESSAGES_BEFORE, int) or 0),
        lost=lost,
        bytes=sum(file.stat().st_size for file in files),
        head=tail.head,
        number=len(files),
        parts=(*(one for one in _listed(path) if one.file != last.name), ended),
    )
    log = AuditLog(path, heading, now_ns, before=before, streams=streams)
    Manifest(trial=metadata.get("trial", ""), parts=before.parts).save(manifest_path(path))
    return log


def _listed(path: Path) -> tuple[Part, ...]:
    try:
        manifest = read_manifest(manifest_path(path))
    except NotAManifest:
        # It is a help and no evidence: a power cut that took it must not cost the log.
        return ()
    return manifest.parts if manifest is not None else ()


def _told(path: Path, opening: Mapping[str, str], name: str, kind: type[T]) -> T | None:
    """Return what an opening record says; None if it does not say it."""
    if name not in opening:
        return None
    try:
        return msgspec.json.decode(opening[name], type=kind)
    except msgspec.DecodeError as error:
        raise ForeignLog(path, f"its opening record says {name!r} wrongly: {error}") from error


def _exists(path: Path, problem: str) -> LogExists:
    return LogExists(
        f"{path} {problem}: a log is never written over, choose another directory", path=path
    )
