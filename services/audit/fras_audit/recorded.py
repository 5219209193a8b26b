"""What a log holds of one trial: messages by key, and the mirrors of queries by query."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar, cast

from fras_common import messages as m
from fras_common import topics as t
from fras_common.codec import MalformedMessage, decode, read_header
from fras_common.scenario import Scenario, patient_scenario
from fras_common.topics import Query, Topic
from fras_log import RawMessage

M = TypeVar("M", bound=m.Header)
Req = TypeVar("Req")
Rep = TypeVar("Rep")

READ: tuple[Topic[Any], ...] = (
    t.TISSUE_MODEL,
    t.TISSUE_STATE,
    t.SIM_CHECKPOINT,
    t.PATIENT.model,
    t.PATIENT.state,
    t.PATIENT.checkpoint,
    t.ROBOT_STATE,
    t.VERDICT,
    t.CONTEXT,
    t.PLAN,
    t.TASK_STATUS,
    t.ACTION_RESULT,
    t.HOLDS,
    t.PRESENCE,
    t.RECORDER_STATUS,
)
_READ = {topic.key: topic for topic in READ}
_QUERIES = {query.key: query for query in t.QUERIES}
_RPC_PREFIX = t.RPC.key.partition("{")[0]
_HEALTH_PREFIX = t.HEALTH.key.partition("{")[0]
# Whose name stands here says who drives the arms.
_DRIVER_KEY = t.CRTK[0].measured_js.key


@dataclass
class Recorded:
    """One trial as recorded.

    Parameters
    ----------
    path, trial : str
    metadata : mapping
        The recorder's own.
    scenario : Scenario
        As the recorder wrote it down.
    damage : str
        Why the file could not be read to its end; empty if it was.
    malformed : int
        Messages of the keys read that could not be understood.
    gaps : dict of str to int
        By key, how many messages are missing by their numbers.
    arms_by : str
        Who drives the arms: `motion`, or the other process that does.
    attachments : mapping of str to bytes
        Files that belong to the trial, by name.
    """

    path: str
    trial: str
    metadata: Mapping[str, str]
    scenario: Scenario
    damage: str = ""
    malformed: int = 0
    gaps: dict[str, int] = field(default_factory=dict[str, int])
    arms_by: str = "motion"
    attachments: Mapping[str, bytes] = field(default_factory=dict[str, bytes])
    _messages: dict[str, list[Any]] = field(default_factory=lambda: defaultdict(list))
    _mirrors: dict[str, list[m.RpcRecord]] = field(default_factory=lambda: defaultdict(list))
    _facts: dict[str, Mapping[str, str]] = field(default_factory=dict[str, Mapping[str, str]])
    _seqs: dict[tuple[str, str], int] = field(default_factory=dict[tuple[str, str], int])

    def of(self, topic: Topic[M]) -> Sequence[M]:
        """Messages of a key, in recorded order."""
        return cast("Sequence[M]", self._messages.get(topic.key, ()))

    def mirrors(self, query: Query[Any, Any]) -> Sequence[m.RpcRecord]:
        """Mirrors of a query, in recorded order."""
        return self._mirrors.get(query.key, ())

    def facts(self, service: str) -> Mapping[str, str]:
        """Return what a service last said of itself."""
        return self._facts.get(service, {})

    def reset(self, query: Query[m.ResetRequest, m.ResetReply]) -> m.ResetRequest | None:
        """Return the reset that began the trial for a service; None if the log does not hold it.

        Without the mirror the recorder's scenario serves, where no mesh file belongs to it; for the
        patient, what is derived from it.
        """
        for mirror in self.mirrors(query):
            if mirror.fault is None:
                return request_of(query, mirror)
        if self.scenario.tissue.mesh_file is not None:
            return None
        own = self.scenario if query != t.PATIENT.reset else patient_scenario(self.scenario)
        return m.ResetRequest(trial=self.trial, scenario=own) if own is not None else None

    def take(self, message: RawMessage) -> None:
        """Add a message of the log; those of other keys and of other trials are passed over."""
        try:
            self._take(message)
        except MalformedMessage:
            self.malformed += 1

    def _take(self, message: RawMessage) -> None:
        key = message.key
        if key.startswith(_HEALTH_PREFIX):
            health = decode(m.Health, message.payload, key)
            self._facts[health.service] = health.facts
            return
        if key not in _READ and key != _DRIVER_KEY and not key.startswith(_RPC_PREFIX):
            return
        header = read_header(message.payload)
        if header is None:
            self.malformed += 1
            return
        if not t.may_be_lost(key):
            self._note_gap(key, header.source, header.seq)
        if key == _DRIVER_KEY:
            self.arms_by = header.source.partition("/")[0]
        elif header.trial == self.trial or key in {t.HOLDS.key, t.PRESENCE.key}:
            # Holds are of no trial: they outlive each. So is who looks at a page.
            self._keep(message)

    def _keep(self, message: RawMessage) -> None:
        topic = _READ.get(message.key)
        if topic is not None:
            self._messages[message.key].append(decode(topic.type, message.payload, message.key))
            return
        mirror = decode(m.RpcRecord, message.payload, message.key)
        query = _QUERIES.get(mirror.key)
        if query is None or query.mirror != message.key:
            raise MalformedMessage(message.key, "$.key", f"mirrors {mirror.key!r}")
        request_of(query, mirror)
        if mirror.fault is None:
            reply_of(query, mirror)
        self._mirrors[mirror.key].append(mirror)

    def _note_gap(self, key: str, source: str, seq: int) -> None:
        last = self._seqs.get((key, source), seq)
        if seq > last + 1:
            self.gaps[key] = self.gaps.get(key, 0) + seq - last - 1
        self._seqs[key, source] = max(last, seq)


def gather(messages: Iterable[RawMessage], recorded: Recorded) -> Recorded:
    """Add all messages of a log to what is recorded of its trial."""
    for message in messages:
        recorded.take(message)
    return recorded


def request_of(query: Query[Req, Any], mirror: m.RpcRecord) -> Req:
    """Return what was asked; raises `MalformedMessage`."""
    return decode(query.request, bytes(mirror.request), query.key)


def reply_of(query: Query[Any, Rep], mirror: m.RpcRecord) -> Rep:
    """Return what was answered, where it was no fault; raises `MalformedMessage`."""
    return decode(query.reply, bytes(mirror.reply), query.key)
