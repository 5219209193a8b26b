"""Collects the messages of a log: every one counted, those of the file's trial understood."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, TypeVar

import msgspec

from fras_cli.report.trial import (
    PatientTick,
    RobotTick,
    ServiceFacts,
    TissueTick,
    TissueViews,
    Trial,
)
from fras_common import topics
from fras_common.codec import HeaderFields, MalformedMessage, decode, read_header
from fras_common.messages import (
    ActionResult,
    Context,
    Header,
    Health,
    LogRecord,
    Plan,
    RobotState,
    TaskRequest,
    TaskStatus,
    TissueModel,
    TissueState,
    Verdict,
)
from fras_common.scenario import Scenario
from fras_log.reader import RawMessage
from fras_log.sound import require_forces, require_surface

T = TypeVar("T")

MAX_WARNINGS = 50


class Mirror(msgspec.Struct):
    """The one part of a query's mirror that the report needs."""

    key: str
    request: msgspec.Raw


class Gathering:
    """What the messages taken so far say about one trial.

    Parameters
    ----------
    name : str
        The trial; messages of another one, left in a publisher's cache, are counted only.

    Attributes
    ----------
    known : int
        Messages of keys that the topic table knows.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self.known = 0
        self._messages = self._lost = self._malformed = 0
        self._seqs: dict[tuple[str, str], int] = {}
        self._first_ns = self._last_ns = self._started_ns = 0
        self._model: TissueModel | None = None
        self._robot: dict[int, RobotTick] = {}
        self._tissue: dict[int, TissueTick] = {}
        self._verdicts: dict[int, Verdict] = {}
        self._patient: dict[int, PatientTick] = {}
        self._views: TissueViews | None = None
        self._top_m = -math.inf
        self._contexts: list[Context] = []
        self._plans: list[Plan] = []
        self._statuses: list[TaskStatus] = []
        self._results: list[ActionResult] = []
        self._services: dict[str, ServiceFacts] = {}
        self._warnings: list[str] = []
        self._handlers: dict[type[Any], Callable[[Any], None]] = {
            ActionResult: self._results.append,
            Context: self._contexts.append,
            LogRecord: self._on_warning,
            Plan: self._plans.append,
            RobotState: self._on_robot,
            TaskStatus: self._statuses.append,
            TissueModel: self._on_model,
            TissueState: self._on_tissue,
            Verdict: self._on_verdict,
        }

    def take(self, message: RawMessage) -> None:
        """Count a message, and understand it where it belongs to the trial."""
        self._messages += 1
        topic = topics.topic_of(message.key)
        self.known += topic is not None
        header = read_header(message.payload)
        if header is None:
            # Recorded verbatim, whoever sent it; the report says how many there were.
            self._malformed += 1
            return
        self._count_gap(message.key, header)
        try:
            if topic is not None:
                self._understand(message, topic.type, header)
        except MalformedMessage:
            self._malformed += 1

    def trial(
        self, path: str, damage: str, metadata: Mapping[str, str], scenario: Scenario
    ) -> Trial:
        """Put everything in order; the arguments are what the file itself tells."""
        return Trial(
            path=path,
            complete=not damage,
            damage=damage,
            metadata=metadata,
            scenario=scenario,
            model=self._model,
            robot=_by_tick(self._robot),
            tissue=_by_tick(self._tissue),
            verdicts=_by_tick(self._verdicts),
            views=self._views,
            contexts=tuple(self._contexts),
            plans=tuple(self._plans),
            statuses=tuple(self._statuses),
            results=tuple(self._results),
            started_ns=self._started_ns,
            first_ns=self._first_ns,
            last_ns=self._last_ns,
            messages=self._messages,
            lost=self._lost,
            malformed=self._malformed,
            services=dict(sorted(self._services.items())),
            warnings=tuple(self._warnings),
            patient=_by_tick(self._patient),
        )

    def _understand(self, message: RawMessage, kind: type[Header], header: HeaderFields) -> None:
        if kind is Health:
            health = decode(Health, message.payload, message.key)
            self._services[health.service] = ServiceFacts(health.source, health.facts)
        if header.trial != self._name:
            return
        self._first_ns = min(header.stamp_ns, self._first_ns or header.stamp_ns)
        self._last_ns = max(header.stamp_ns, self._last_ns)
        if message.key == topics.TASK.mirror:
            self._on_task(decode(Mirror, message.payload, message.key))
        elif message.key == topics.PATIENT.state.key:
            self._on_patient(decode(TissueState, message.payload, message.key))
        elif message.key != topics.PATIENT.model.key and kind in self._handlers:
            self._handlers[kind](decode(kind, message.payload, message.key))

    def _count_gap(self, key: str, header: HeaderFields) -> None:
        stream = (key, header.source)
        last = self._seqs.get(stream)
        if last is not None and header.seq > last + 1 and not topics.may_be_lost(key):
            self._lost += header.seq - last - 1
        self._seqs[stream] = header.seq if last is None else max(header.seq, last)

    def _on_task(self, mirror: Mirror) -> None:
        request = decode(TaskRequest, bytes(mirror.request), mirror.key)
        if request.command == "start" and request.trial == self._name:
            self._started_ns = request.started_ns

    def _on_model(self, model: TissueModel) -> None:
        require_surface(model)
        self._model = model

    def _on_robot(self, state: RobotState) -> None:
        # A tick is published again when someone holds or resumes: its time is the first one's.
        before = self._robot.get(state.tick)
        action = state.action
        self._robot[state.tick] = RobotTick(
            tick=state.tick,
            stamp_ns=state.stamp_ns if before is None else before.stamp_ns,
            tips_in_world={name: arm.tip_in_world for name, arm in state.arms.items()},
            goal_id=action.goal_id if action else "",
            action=action.name if action else "",
            arm=action.arm if action else "",
            phase=action.phase if action else "",
            held=bool(state.holds) or (before is not None and before.held),
        )

    def _on_tissue(self, state: TissueState) -> None:
        require_forces(state)
        top_m = float(state.nodes_m.floats()[:, 2].max(initial=-math.inf))
        views = self._views or TissueViews(first=state, highest=state, last=state)
        if top_m > self._top_m:
            self._top_m, views = top_m, replace(views, highest=state)
        if state.tick >= views.last.tick:
            views = replace(views, last=state)
        self._views = views
        self._tissue[state.tick] = TissueTick(
            tick=state.tick,
            max_force_n=state.max_force_n,
            iterations=state.solver.iterations,
            wall_s=state.solver.wall_s,
            converged=state.solver.converged,
        )

    def _on_patient(self, state: TissueState) -> None:
        tool_n = (math.hypot(*force) for force in state.tool_force_n.values())
        self._patient[state.tick] = PatientTick(
            tick=state.tick,
            max_force_n=state.max_force_n,
            tool_force_n=max(tool_n, default=0.0),
        )

    def _on_verdict(self, verdict: Verdict) -> None:
        self._verdicts[verdict.tick] = verdict

    def _on_warning(self, record: LogRecord) -> None:
        if len(self._warnings) < MAX_WARNINGS:
            fields = "".join(f", {name} = {value}" for name, value in record.fields.items())
            service = record.source.partition("/")[0]
            self._warnings.append(f"{service}: {record.level}: {record.event}{fields}")


def _by_tick(entries: Mapping[int, T]) -> tuple[T, ...]:
    return tuple(entries[tick] for tick in sorted(entries))
