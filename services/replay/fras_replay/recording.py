"""A log read into a time line, its payloads in a scratch file: the hours of a long one, too."""

import mmap
import tempfile
from array import array
from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from fras_common.codec import HeaderFields, MalformedMessage, decode, read_header
from fras_common.messages import ReplayMark
from fras_common.topics import (
    ACTION_RESULT,
    HOLDS,
    PLAN,
    ROBOT_STATE,
    TASK_STATUS,
    VERDICT,
    Qos,
    topic_of,
)
from fras_log import ForeignLog
from fras_log.events import Broken, Cut, Recorded, Told
from fras_log.names import METADATA
from fras_log.pieces import scan_log
from fras_replay.errors import NothingToReplay
from fras_replay.marks import MarkFinder
from fras_replay.selection import Selection
from fras_replay.timeline import Place, Ticks, Timeline

NS = 1_000_000_000
MARKING = {topic.key: topic for topic in (PLAN, VERDICT, ROBOT_STATE, ACTION_RESULT, HOLDS)} | {
    TASK_STATUS.key: TASK_STATUS
}
# A key that the table does not know travels like most.
UNKNOWN = Qos.STATE
SCHEMAS = "fras."


@dataclass(frozen=True)
class Line:
    """A key that is replayed.

    Attributes
    ----------
    recorded, key : str
        In the log, and as it is sent.
    qos : Qos
        By the topic table, of the recorded key.
    """

    recorded: str
    key: str
    qos: Qos


@dataclass(frozen=True)
class Mark:
    """A place of interest, and what is told of it."""

    place: Place
    told: ReplayMark


@dataclass(frozen=True)
class Message:
    """A message as it goes out."""

    line: int
    payload: bytes
    encoding: str


@dataclass(frozen=True)
class Recording:
    """A log, ready to be replayed; `close` gives the scratch file back.

    Attributes
    ----------
    path : Path
    trial : str
        As the log says of itself.
    began_ns : int
        When the recorder got its first message [ns since the Unix epoch].
    timeline : Timeline
    lines : sequence of Line
    marks : sequence of Mark
    damage : sequence of str
        What of the file could not be read.
    """

    path: Path
    trial: str
    began_ns: int
    timeline: Timeline
    lines: Sequence[Line]
    marks: Sequence[Mark]
    damage: Sequence[str]
    _encodings: Sequence[str] = field(repr=False)
    _index: "_Index" = field(repr=False)
    _scratch: mmap.mmap = field(repr=False)

    def message(self, number: int) -> Message:
        """Read a message."""
        index = self._index
        stop = index.stops[number]
        start = index.stops[number - 1] if number else 0
        encoding = self._encodings[index.encodings[number]]
        return Message(index.lines[number], self._scratch[start:stop], encoding)

    def mark_at(self, place: Place) -> int:
        """Return the number of the last mark at or before a place, or -1."""
        return bisect_right([mark.place for mark in self.marks], place) - 1

    def mark_before(self, place: Place, back_ns: int) -> int:
        """Return the number of the last mark before a place and `back_ns` before that, or -1."""
        by_order = bisect_left([mark.place for mark in self.marks], place)
        by_time = bisect_right([mark.place.at_ns for mark in self.marks], place.at_ns - back_ns)
        return min(by_order, by_time) - 1

    def mark_text(self, number: int) -> str:
        """Return what a mark tells, in words; empty for none."""
        if number < 0:
            return ""
        told = self.marks[number].told
        return f"{told.kind} {told.text}"

    def close(self) -> None:
        """Give the scratch file back."""
        self._scratch.close()


@dataclass(frozen=True)
class _Index:
    """Of each message that is replayed: its line, its encoding, where it ends in the scratch."""

    lines: "array[int]" = field(default_factory=lambda: array("l"))
    encodings: "array[int]" = field(default_factory=lambda: array("l"))
    stops: "array[int]" = field(default_factory=lambda: array("q"))


def read_recording(path: Path, selection: Selection) -> Recording:
    """Read a log.

    Raises
    ------
    NoSuchLog, NotAnMcap
        It can't be read, or is no MCAP file.
    ForeignLog
        No recorder of ours wrote it.
    NothingToReplay
        It holds no message, or none is selected.
    BadKey
        The selection does not fit it.
    """
    opening, keys, ours, damage = _survey(path)
    if opening is None and not ours:
        raise ForeignLog(path, f"it has no record `{METADATA}`" + _because(damage))
    if not keys:
        raise NothingToReplay(f"{path}: holds no message" + _because(damage), path=path)
    chosen = selection.choose(keys)
    if not chosen:
        raise NothingToReplay(f"{path}: every key is left out", path=path)
    trial = (opening or {}).get("trial", "")
    # Without a name: it goes with the process, however that ends.
    with tempfile.TemporaryFile() as file:
        reader = _Reader(file, chosen, trial)
        for message in _messages(path):
            reader.take(message)
        return reader.finish(path, damage)


def _because(damage: Sequence[str]) -> str:
    return f"; it is damaged: {damage[0]}" if damage else ""


def _survey(path: Path) -> tuple[dict[str, str] | None, list[str], bool, list[str]]:
    """Return what the log says of itself, its keys, if they are ours, and what is wrong with it."""
    opening: dict[str, str] | None = None
    keys: dict[str, None] = {}
    ours = False
    damage: list[str] = []
    for event in scan_log(path):
        match event:
            case Told(name=name, content=content) if name == METADATA:
                opening = content
            case Recorded(channel=channel):
                keys[channel.topic] = None
                # Where the damage took the beginning, the schemas tell whose log it was.
                ours = ours or channel.schema.startswith(SCHEMAS)
            case Broken(offset=offset, text=text) | Cut(offset=offset, text=text):
                damage.append(f"offset {offset}: {text}")
            case _:
                pass
    return opening, list(keys), ours, damage


def _messages(path: Path) -> Iterator[Recorded]:
    return (event for event in scan_log(path) if isinstance(event, Recorded))


class _Reader:
    def __init__(self, file: BinaryIO, chosen: dict[str, str], trial: str) -> None:
        self._file = file
        self._trial = trial
        self._lines = [
            Line(key, name, topic.qos if (topic := topic_of(key)) is not None else UNKNOWN)
            for key, name in chosen.items()
        ]
        self._numbers = {line.recorded: number for number, line in enumerate(self._lines)}
        self._index = _Index()
        self._encodings: dict[str, int] = {}
        self._bytes = 0
        self._due_ns: array[int] = array("q")
        self._lasting: defaultdict[int, array[int]] = defaultdict(lambda: array("q"))
        self._starts = Ticks([], [])
        self._verdicts = Ticks([], [])
        self._finder = MarkFinder()
        self._marks: list[Mark] = []
        self._first_ns = -1
        self._now_ns = 0

    def take(self, message: Recorded) -> None:
        if self._first_ns < 0:
            self._first_ns = message.log_time
        # The recorder's clock may be set back, and its threads may overtake each other.
        self._now_ns = max(self._now_ns, message.log_time - self._first_ns)
        before = self._place()
        self._keep(message)
        header = read_header(message.payload)
        if header is not None and self._of_the_trial(header):
            if message.topic == ROBOT_STATE.key:
                _note(self._starts, before, header.tick)
            elif message.topic == VERDICT.key:
                _note(self._verdicts, self._place(), header.tick)
        if message.topic in MARKING:
            self._mark(message, header)

    def finish(self, path: Path, damage: Sequence[str]) -> Recording:
        if not self._due_ns:
            raise NothingToReplay(f"{path}: no message is left of it", path=path)
        # An empty file can't be mapped, and messages may be empty.
        self._file.write(b"\0")
        self._file.flush()
        scratch = mmap.mmap(self._file.fileno(), 0, access=mmap.ACCESS_READ)
        timeline = Timeline(
            due_ns=self._due_ns,
            duration_ns=self._now_ns,
            starts=self._starts,
            verdicts=self._verdicts,
            lasting=dict(self._lasting),
        )
        return Recording(
            path=path,
            trial=self._trial,
            began_ns=self._first_ns,
            timeline=timeline,
            lines=self._lines,
            marks=self._marks,
            damage=damage,
            _encodings=list(self._encodings),
            _index=self._index,
            _scratch=scratch,
        )

    def _place(self) -> Place:
        return Place(len(self._due_ns), self._now_ns)

    def _of_the_trial(self, header: HeaderFields) -> bool:
        # What the caches still held of the trial before is in the log, but none of its ticks.
        return not self._trial or header.trial == self._trial

    def _keep(self, message: Recorded) -> None:
        number = self._numbers.get(message.topic)
        if number is None:
            return
        self._file.write(message.payload)
        self._bytes += len(message.payload)
        self._index.lines.append(number)
        encoding = self._encodings.setdefault(message.channel.encoding, len(self._encodings))
        self._index.encodings.append(encoding)
        self._index.stops.append(self._bytes)
        if _lasts(message.topic):
            self._lasting[number].append(len(self._due_ns))
        self._due_ns.append(self._now_ns)

    def _mark(self, message: Recorded, header: HeaderFields | None) -> None:
        topic = MARKING[message.topic]
        try:
            decoded = decode(topic.type, message.payload, message.topic)
        except MalformedMessage:
            return  # replayed like any other, but it tells nothing
        if (found := self._finder.look(decoded)) is None:
            return
        tick = header.tick if header is not None and header.tick >= 0 else self._tick()
        told = ReplayMark(
            number=len(self._marks),
            kind=found.kind,
            position_s=self._now_ns / NS,
            log_time_ns=message.log_time,
            tick=tick,
            text=found.text,
        )
        self._marks.append(Mark(self._place(), told))

    def _tick(self) -> int:
        return self._starts.numbers[-1] if self._starts.numbers else -1


def _lasts(key: str) -> bool:
    """Whether a key's last message says how things stand; logs, faults and mirrors are events."""
    topic = topic_of(key)
    return topic is not None and topic.qos in (Qos.STATE, Qos.EVENT) and "{" not in topic.key


def _note(ticks: Ticks, place: Place, number: int) -> None:
    """Note a place unless it is a repetition: a service that was restarted says its last again."""
    if number > max(ticks.numbers[-1:], default=-1):
        ticks.places.append(place)
        ticks.numbers.append(number)
