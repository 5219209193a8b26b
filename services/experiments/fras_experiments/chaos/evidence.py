"""What a log holds, as far as the invariants ask for it."""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fras_common import messages as m
from fras_common.codec import decode, read_header
from fras_common.scenario import Scenario
from fras_common.topics import (
    EXECUTE,
    RECORDER_EVENT,
    ROBOT_STATE,
    TASK_STATUS,
    TISSUE_STATE,
    VERDICT,
    Topic,
    may_be_lost,
)
from fras_log import LogReader
from fras_log.about import scenario_of, trial_of

_READ: tuple[Topic[Any], ...] = (
    ROBOT_STATE,
    TISSUE_STATE,
    VERDICT,
    TASK_STATUS,
    RECORDER_EVENT,
)
_TOPICS = {topic.key: topic for topic in _READ}


@dataclass(frozen=True)
class Said:
    """A tissue state: when, by whom, and a digest of what it says."""

    tick: int
    source: str
    digest: bytes


@dataclass(frozen=True)
class Accepted:
    """A goal that motion took, and which motion."""

    goal_id: str
    source: str


@dataclass
class Evidence:
    """Messages of one trial, in recorded order.

    Attributes
    ----------
    arrivals_ns : list of int
        When the recorder heard each of `states`.
    numbers : dict
        By key and publisher, the numbers of its messages; telemetry, which may be lost, is left
        out.
    order : list
        `states` and `events` as they came in, one among the other.
    """

    trial: str
    states: list[m.RobotState] = field(default_factory=list[m.RobotState])
    arrivals_ns: list[int] = field(default_factory=list[int])
    tissues: list[Said] = field(default_factory=list[Said])
    verdicts: list[m.Verdict] = field(default_factory=list[m.Verdict])
    statuses: list[m.TaskStatus] = field(default_factory=list[m.TaskStatus])
    accepted: list[Accepted] = field(default_factory=list[Accepted])
    numbers: dict[tuple[str, str], list[int]] = field(
        default_factory=dict[tuple[str, str], list[int]]
    )
    order: list[m.RobotState | m.RecorderEvent] = field(
        default_factory=list[m.RobotState | m.RecorderEvent]
    )

    def take(self, key: str, payload: bytes, arrival_ns: int) -> None:
        """Add a message of the log.

        Raises
        ------
        MalformedMessage
        """
        header = read_header(payload)
        if header is None:
            return
        if not may_be_lost(key):
            self.numbers.setdefault((key, header.source), []).append(header.seq)
        if key in _TOPICS:
            self._keep(decode(_TOPICS[key].type, payload, key), arrival_ns)
        elif key == EXECUTE.mirror:
            self._keep_goal(decode(m.RpcRecord, payload, key))

    def _keep(self, message: m.Header, arrival_ns: int) -> None:
        if isinstance(message, m.RecorderEvent):
            self.order.append(message)
            return
        if message.trial != self.trial:
            return
        match message:
            case m.RobotState():
                self.states.append(message)
                self.arrivals_ns.append(arrival_ns)
                self.order.append(message)
            case m.TissueState():
                content = message.nodes_m.data + message.nodal_force_n.data
                digest = hashlib.blake2b(content, digest_size=16).digest()
                self.tissues.append(Said(message.tick, message.source, digest))
            case m.Verdict():
                self.verdicts.append(message)
            case m.TaskStatus():
                self.statuses.append(message)
            case _:
                pass

    def _keep_goal(self, mirror: m.RpcRecord) -> None:
        if mirror.fault is not None or mirror.key != EXECUTE.key:
            return
        request = decode(EXECUTE.request, bytes(mirror.request), EXECUTE.key)
        reply = decode(EXECUTE.reply, bytes(mirror.reply), EXECUTE.key)
        if reply.accepted and request.trial == self.trial:
            self.accepted.append(Accepted(request.goal_id, mirror.source))

    @property
    def ending(self) -> m.TaskStatus | None:
        """The status that names the outcome; None where there is none."""
        return next((one for one in reversed(self.statuses) if one.outcome), None)

    def tick_times_ns(self, by_arrival: bool) -> list[int]:
        """When each tick was first told, in the order of the ticks [ns since the Unix epoch].

        Parameters
        ----------
        by_arrival : bool
            By the recorder's clock instead of motion's.
        """
        times: list[int] = []
        last = -1
        for state, arrival_ns in zip(self.states, self.arrivals_ns, strict=True):
            if state.tick > last:
                last = state.tick
                times.append(arrival_ns if by_arrival else state.stamp_ns)
        return times


def gather(trial: str, samples: Iterable[tuple[str, bytes, int]]) -> Evidence:
    """Make evidence of keys, payloads and arrivals."""
    evidence = Evidence(trial)
    for key, payload, arrival_ns in samples:
        evidence.take(key, payload, arrival_ns)
    return evidence


def read_evidence(path: Path) -> tuple[Evidence, Scenario]:
    """Read a log, with all files that it has.

    Raises
    ------
    NoSuchLog, NotAnMcap, ForeignLog
        There is nothing to look into.
    MalformedMessage
        A payload does not fit its key.
    """
    reader = LogReader(path)
    evidence: Evidence | None = None
    for message in reader.messages():
        if evidence is None:
            evidence = Evidence(trial_of(reader))
        evidence.take(*message)
    return evidence or Evidence(trial_of(reader)), scenario_of(reader)
