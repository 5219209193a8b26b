"""Whether a log is what was recorded: bytes, chain, signature, numbers, payloads, interlock."""

from collections.abc import Sequence
from pathlib import Path

from fras_log.content import Content
from fras_log.custody import Custody, GoesOn
from fras_log.errors import ForeignLog, NoSuchLog, NotAManifest, NotAnMcap
from fras_log.events import Attached, Began, Broken, Cut, Ended, Recorded, Told
from fras_log.findings import Finding, Verification
from fras_log.keys import PublicKey
from fras_log.names import (
    FINISHED,
    HEAD_BEFORE,
    KILLED,
    MESSAGES_BEFORE,
    METADATA,
    NEXT,
    OPENED,
    PART,
    PROFILE,
)
from fras_log.parts import Manifest, Part, manifest_path, parts_of, read_manifest
from fras_log.scan import Progress, scan
from fras_log.tail import read_opening

__all__ = ["Finding", "Verification", "verify_file"]


def verify_file(
    path: Path,
    trusted: Sequence[PublicKey] = (),
    head: str = "",
    progress: Progress | None = None,
) -> Verification:
    """Verify a log, with all files that it has.

    Parameters
    ----------
    path : Path
        Its first file.
    trusted : sequence of PublicKey
        Whose signatures make it authentic.
    head : str
        Head that was noted elsewhere when the log was closed; empty: none was.
    progress : callable, optional
        Told how many bytes are read, of how many, file by file.

    Raises
    ------
    NoSuchLog, NotAnMcap, ForeignLog
        There is nothing to verify.
    """
    found = Verification()
    verifier = _Verifier(found, path, trusted, progress)
    number = 0
    # Looked for anew each time: a log that is still written may grow by a file meanwhile.
    while number < len(files := parts_of(path)):
        file, found.parts, number = files[number], len(files), number + 1
        found.file = file.name if len(files) > 1 else ""
        try:
            verifier.read(file, number)
        except (NoSuchLog, NotAnMcap, ForeignLog) as error:
            if number == 1:
                raise
            found.add(Finding("parts", str(error)))
            verifier.miss()
    found.file = ""
    if head and head != found.head:
        text = f"the head is {found.head}, not the one that was noted"
        found.add(Finding("chain", text))
    verifier.finish()
    return found


class _Verifier:
    def __init__(
        self,
        found: Verification,
        path: Path,
        trusted: Sequence[PublicKey],
        progress: Progress | None,
    ) -> None:
        self._found = found
        self._path = path
        self._trusted = trusted
        self._progress = progress
        self._content = Content(found)
        self._ends: dict[str, Custody] = {}
        self._unbroken = True
        self._manifest = self._read_manifest()

    def _read_manifest(self) -> Manifest | None:
        """Read it before the files: those that it names are finished then, and don't change."""
        try:
            return read_manifest(manifest_path(self._path))
        except NotAManifest as error:
            self._found.add(Finding("parts", str(error)))
            return None

    def read(self, file: Path, number: int) -> None:
        """Verify a file of the log."""
        found, content = self._found, self._content
        custody = Custody(found, self._trusted)
        profile = PROFILE
        ended, cut = False, list[Finding]()
        for event in scan(file, self._progress):
            match event:
                case Recorded():
                    # Said early: a large file of someone else's need not be read to its end.
                    if profile != PROFILE and custody.opening is None:
                        break
                    custody.take_message(event, content.take(event))
                case Told(offset=offset, name=name, content=told):
                    if name == METADATA and custody.opening is None:
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
                    cut.append(Finding("end", text, offset))
                case Began(profile=profile):
                    custody.begin(event)
                case Ended():
                    ended = custody.closing is not None
                    if not ended:
                        text = "the closing record is missing"
                        found.add(Finding("structure", text, event.offset))
        if profile != PROFILE and custody.opening is None:
            raise ForeignLog(file, f"its profile is {profile!r}, not {PROFILE!r}")
        self._check_number(custody, number)
        files = parts_of(self._path)
        following = files[number] if number < len(files) else None
        if following is not None and (custody.closing or {}).get("reason") == FINISHED:
            text = f"this file ends the log, and {following.name} is behind it"
            found.add(Finding("parts", text))
        vouched = custody.finish(_goes_on(custody, following))
        if vouched and custody.closing is None:
            found.unfinished.append(file.name)
        elif not vouched:
            for finding in cut:
                found.add(finding)
        following_name = (custody.closing or {}).get(NEXT, "")
        if following is None and following_name:
            found.add(Finding("parts", f"the next file, {following_name}, is missing"))
            ended = False
        found.closed = ended
        self._add(file, custody)

    def miss(self) -> None:
        """Note that a file is not there, or none of the log."""
        self._unbroken = False
        self._found.closed = False
        self._found.signed_by, self._found.trusted = "", False
        self._content.lose()

    def finish(self) -> None:
        """Say what takes all files to say."""
        if self._manifest is not None:
            self._hold_against(self._manifest)
        self._content.finish()

    def _add(self, file: Path, custody: Custody) -> None:
        found, first = self._found, not self._ends
        self._ends[file.name] = custody
        if first:
            found.opening = custody.opening or {}
        found.messages += custody.messages
        if self._unbroken:
            found.chained += custody.chained
        self._unbroken = self._unbroken and custody.chained == custody.messages
        found.head = custody.head
        same = custody.signed_by == found.signed_by or first
        found.signed_by = custody.signed_by if same and self._unbroken else ""
        found.trusted = custody.trusted and (first or found.trusted) and bool(found.signed_by)

    def _check_number(self, custody: Custody, number: int) -> None:
        opening = custody.opening
        if opening is None:
            return
        told = opening.get(PART, "1")
        if told != str(number):
            text = f"this is part {told} of a log, not part {number}"
            self._found.add(Finding("parts", text))
            self._content.lose()
        elif self._ends and opening.get("trial") != self._found.opening.get("trial"):
            text = f"this is of trial {opening.get('trial')!r}, not of the first file's"
            self._found.add(Finding("parts", text))

    def _hold_against(self, manifest: Manifest) -> None:
        trial = self._found.opening.get("trial", "")
        if manifest.trial != trial:
            text = f"the manifest tells of trial {manifest.trial!r}, the log is of {trial!r}"
            self._found.add(Finding("parts", text))
        names = [part.file for part in manifest.parts]
        if [name for name in self._ends if name in names] != [
            name for name in names if name in self._ends
        ]:
            text = "the manifest names files twice, or in another order"
            self._found.add(Finding("parts", text))
        for part in manifest.parts:
            custody = self._ends.get(part.file)
            if custody is None:
                text = "the manifest names this file, and it is missing"
            else:
                text = _differs(part, custody, self._path.with_name(part.file).stat().st_size)
            if text:
                self._found.add(Finding("parts", text, file=part.file))


def _differs(part: Part, custody: Custody, size: int) -> str:
    """Say what a manifest tells of a file that is not so; empty if all is."""
    if (part.messages, part.head) != (custody.messages, custody.head):
        return (
            f"the manifest tells of {part.messages} messages and head {part.head}; here are "
            f"{custody.messages}, and the head is {custody.head}"
        )
    if part.bytes != size:
        return f"the manifest tells of {part.bytes} bytes, here are {size}"
    reason = (custody.closing or {}).get("reason", KILLED)
    if part.reason != reason:
        return f"the manifest tells that it ended as {part.reason!r}, it did as {reason!r}"
    began_ns = (custody.opening or {}).get(OPENED, "0")
    if str(part.began_ns) != began_ns:
        return f"the manifest tells that it began at {part.began_ns} ns, it did at {began_ns} ns"
    return ""


def _goes_on(custody: Custody, following: Path | None) -> GoesOn | None:
    """Return what the next file says of the end of this one, if it is there."""
    if following is None:
        return None
    try:
        told = read_opening(following)
        before = int(told[MESSAGES_BEFORE]) - int((custody.opening or {}).get(MESSAGES_BEFORE, "0"))
        return GoesOn(following.name, before, told[HEAD_BEFORE])
    except (NoSuchLog, NotAnMcap, KeyError, ValueError):
        # The next file itself will be read, and found to be none of this log.
        return None
