"""What the messages of a log say: numbers without gaps, payloads that fit, the interlock."""

import re
from collections import Counter
from functools import cache
from importlib.metadata import version
from typing import Any, NamedTuple

from fras_common.codec import HeaderFields, MalformedMessage, decode, read_header
from fras_common.messages import Header, RobotState, Verdict
from fras_common.topics import ROBOT_STATE, VERDICT, Topic, may_be_lost, topic_of
from fras_log.events import Recorded
from fras_log.findings import Finding, Verification


@cache
def _own_version() -> str:
    return version("fras")


class _Place(NamedTuple):
    """Where a message stands."""

    offset: int
    topic: str
    sequence: int
    tick: int
    file: str


class _Move(NamedTuple):
    """A state of the arms, and where it stands."""

    trial: str
    tick: int
    verdict_tick: int
    place: _Place


class Content:
    """Looks into each message.

    Parameters
    ----------
    found : Verification
        Where to put what is found.
    """

    def __init__(self, found: Verification) -> None:
        self._found = found
        self._topics: dict[str, Topic[Any] | None] = {}
        self._next: dict[tuple[str, str], int] = {}
        self._verdicts: set[tuple[str, int]] = set()
        self._states: set[tuple[str, int]] = set()
        # Verdicts on states that were not there yet.
        self._blind: dict[tuple[str, int], _Place] = {}
        # Of which the verdict was not there yet; one of many that say the same.
        self._moves: dict[tuple[str, int, int], _Move] = {}
        self._whole = True
        self._newer = ""
        self._opening_offset = -1
        self._foreign: Counter[str] = Counter()

    def open(self, offset: int, opening: dict[str, str]) -> None:
        """Note who wrote the log."""
        written = opening.get("fras_version", "")
        if _release(written) > _release(_own_version()):
            self._newer, self._opening_offset = written, offset

    def take(self, message: Recorded) -> int:
        """Look into a message; return its tick, -1 if it has none."""
        key = message.topic
        if key not in self._topics:
            self._topics[key] = topic_of(key)
        topic = self._topics[key]
        decoded: Header | None = None
        if topic is None:
            self._foreign[key] += bool(self._newer)
        else:
            decoded = self._decode(topic, message)
        header = decoded if decoded is not None else read_header(message.payload)
        if header is None:
            return -1
        if not may_be_lost(key):
            self._count(message, header)
        if topic is VERDICT and isinstance(decoded, Verdict):
            self._note_verdict((decoded.trial, decoded.tick), message)
        elif topic is ROBOT_STATE and isinstance(decoded, RobotState):
            self._note_move(decoded, message)
        return header.tick

    def lose(self) -> None:
        """Note that messages are missing here: that others miss them is no finding of its own."""
        self._whole = False
        self._next.clear()

    def finish(self) -> None:
        """Say what takes all messages to say."""
        if self._newer:
            self._tell_version()
        # Keys have no order between them: a verdict may stand behind what was done on it.
        for move in self._moves.values():
            judged = not self._whole or (move.trial, move.tick - 1) in self._verdicts
            if not judged or move.verdict_tick != move.tick - 1:
                text = f"the arms moved on verdict {move.verdict_tick}"
                text += "" if judged else f", and there is none for tick {move.tick - 1}"
                self._found.add(Finding("interlock", text, *move.place))
        if self._states and self._blind and self._whole and self._found.intact:
            # Whoever sent them was killed, and the recorder with it: no later number tells.
            ticks = [tick for _, tick in self._blind]
            text = (
                f"states of the arms never arrived, {len(ticks)} of ticks {min(ticks)} to "
                f"{max(ticks)}: there are verdicts on them"
            )
            self._found.add(Finding("interlock", text, *next(iter(self._blind.values()))))

    def _note_verdict(self, judged: tuple[str, int], message: Recorded) -> None:
        self._verdicts.add(judged)
        if judged not in self._states:
            self._blind.setdefault(judged, self._place(message, judged[1]))

    def _place(self, message: Recorded, tick: int) -> _Place:
        return _Place(message.offset, message.topic, message.sequence, tick, self._found.file)

    def _note_move(self, state: RobotState, message: Recorded) -> None:
        self._states.add((state.trial, state.tick))
        self._blind.pop((state.trial, state.tick), None)
        before = state.tick - 1
        on_it = state.verdict_tick == before and (state.trial, before) in self._verdicts
        name = (state.trial, state.tick, state.verdict_tick)
        if before < 0 or on_it or name in self._moves:
            return
        self._moves[name] = _Move(
            state.trial, state.tick, state.verdict_tick, self._place(message, state.tick)
        )

    def _decode(self, topic: Topic[Any], message: Recorded) -> Any:
        try:
            return decode(topic.type, message.payload, message.topic)
        except MalformedMessage as error:
            if self._newer:
                self._foreign[message.topic] += 1
                return None
            header = read_header(message.payload)
            tick = header.tick if header is not None else -1
            self._found.add(
                Finding("schema", str(error), message.offset, message.topic, message.sequence, tick)
            )
        return None

    def _count(self, message: Recorded, header: Header | HeaderFields) -> None:
        stream = (message.topic, header.source)
        expected = self._next.get(stream)
        # One that begins in mid-stream is no gap: the publisher is older than the log. Telemetry
        # may be lost: the next one replaces it.
        if expected is not None and header.seq > expected:
            text = f"{header.seq - expected} messages before this one never arrived"
            self._found.add(
                Finding("sequence", text, message.offset, message.topic, header.seq, header.tick)
            )
        self._next[stream] = max(header.seq + 1, expected or 0)

    def _tell_version(self) -> None:
        text = f"FRAS {self._newer} wrote this log, newer than this one ({version('fras')})"
        foreign = sum(self._foreign.values())
        if foreign:
            keys = ", ".join(sorted(key for key, count in self._foreign.items() if count))
            text += f"; {foreign} messages can't be understood here, of {keys}"
        self._found.add(Finding("version", text, self._opening_offset))


def _release(text: str) -> tuple[int, ...]:
    """Return the numbers that a version begins with; none if it is no version."""
    found = re.match(r"\d{1,9}(\.\d{1,9})*", text)
    numbers = [int(one) for one in found[0].split(".")] if found else []
    while numbers and numbers[-1] == 0:
        numbers.pop()
    return tuple(numbers)
