"""Turns the messages of a trial, one by one, into what a viewer can show of them."""

import re
from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np

from fras_common.codec import HeaderFields, MalformedMessage, decode, read_header
from fras_common.messages import (
    ActionResult,
    Context,
    LogRecord,
    Plan,
    RobotState,
    TaskStatus,
    TissueModel,
    TissueState,
    Verdict,
)
from fras_common.scenario import Scenario
from fras_common.topics import CONTEXT, PATIENT, TISSUE_STATE, topic_of
from fras_log.anchors import Anchors, FloatArray, bind
from fras_log.export.facts import (
    Arms,
    BlockKind,
    Blocks,
    Fact,
    Gauges,
    Level,
    Moment,
    Sentence,
    Stage,
    Tissue,
)
from fras_log.export.instruments import instrument
from fras_log.reader import RawMessage
from fras_log.sound import require_forces, require_surface

NOT_A_NUMBER: Final = float("nan")
_FIXED = re.compile(r"fixed\((b\(\d+,\d+\))\)")


class Teller:
    """Understands one trial; what it has seen so far decides what a message shows.

    Parameters
    ----------
    trial : str
        Messages of another one, left in a publisher's cache, show nothing.
    scenario : Scenario

    Attributes
    ----------
    known : int
        Messages of keys that the topic table knows.
    malformed : int
        Messages of the trial that could not be understood.
    """

    def __init__(self, trial: str, scenario: Scenario) -> None:
        self._trial = trial
        self._awareness = scenario.awareness
        self.known = self.malformed = 0
        self._tick = -1
        self._stage: Stage | None = None
        self._nodes_m: FloatArray | None = None
        self._block_names: tuple[str, ...] = ()
        self._blocks_rest_m: FloatArray = np.empty((0, 3))
        self._anchors: Anchors | None = None
        self._fixed: frozenset[str] = frozenset()
        self._chosen = ""
        self._grasping: dict[str, str] = {}
        self._held: frozenset[str] = frozenset()
        self._begun_ns: tuple[int, int] | None = None
        self._tick_ms = NOT_A_NUMBER
        self._solve_ms: tuple[int, float] = (-1, NOT_A_NUMBER)
        self._plans = 0
        self._handlers: dict[type[Any], Callable[[Any, Moment], Iterator[Fact]]] = {
            ActionResult: self._on_result,
            Context: self._on_context,
            LogRecord: self._on_record,
            Plan: self._on_plan,
            RobotState: self._on_robot,
            TaskStatus: self._on_status,
            TissueModel: self._on_model,
            TissueState: self._on_tissue,
            Verdict: self._on_verdict,
        }

    @property
    def tick(self) -> int:
        """The latest tick of which anything was told; -1 before the first."""
        return self._tick

    def tell(self, message: RawMessage) -> list[Fact]:
        """Return what a message shows; nothing where it is none of the trial's, or malformed."""
        topic = topic_of(message.key)
        self.known += topic is not None
        header = read_header(message.payload)
        if header is None:
            self.malformed += 1
            return []
        if topic is None or header.trial != self._trial or topic.type not in self._handlers:
            return []
        if topic.producer == PATIENT.service:
            # What is drawn is the model, by whose force the trial goes.
            return []
        try:
            content = decode(topic.type, message.payload, message.key)
            return list(self._handlers[topic.type](content, self._moment(header, message)))
        except MalformedMessage:
            self.malformed += 1
            return []

    def _moment(self, header: HeaderFields, message: RawMessage) -> Moment:
        self._tick = max(self._tick, header.tick)
        tick = header.tick if header.tick >= 0 else max(self._tick, 0)
        return Moment(tick, header.stamp_ns, message.arrival_ns, header.seq)

    def _on_model(self, model: TissueModel, moment: Moment) -> Iterator[Fact]:
        require_surface(model)
        surface, rest_m = model.surface.ints(), model.nodes_m.floats()
        limit_n = self._awareness.force_limit_n
        self._stage = Stage(
            moment=moment,
            rest_m=rest_m,
            surface=surface,
            attachments_m=model.fixed_points_m.floats(),
            roi_m=model.roi_m,
            clear_m=self._awareness.visible_distance_m,
            limit_n=limit_n,
            hard_limit_n=self._awareness.hard_limit_n or 2.0 * limit_n,
        )
        self._anchors = None
        yield self._stage

    def _on_tissue(self, state: TissueState, moment: Moment) -> Iterator[Fact]:
        if self._stage is None:
            return
        if state.nodes_m.shape != self._stage.rest_m.shape:
            problem = f"{len(state.nodes_m.view())} nodes are not those of the tissue's model"
            raise MalformedMessage(TISSUE_STATE.key, "$.nodes_m", problem)
        require_forces(state)
        self._nodes_m = state.nodes_m.floats()
        self._solve_ms = (state.tick, 1e3 * state.solver.wall_s)
        holding = (arm for arm, nodes in state.grasped.items() if nodes)
        self._held = frozenset(self._grasping[arm] for arm in holding if arm in self._grasping)
        force_n = np.linalg.norm(state.nodal_force_n.floats(), axis=1)
        yield Tissue(moment, self._nodes_m, force_n)
        yield from self._blocks(moment)

    def _on_robot(self, state: RobotState, moment: Moment) -> Iterator[Fact]:
        if state.action is not None and state.action.name == "grasp":
            self._grasping[state.action.arm] = state.action.block
        before = self._begun_ns
        # A tick is published again when someone holds or resumes: its time is the first one's.
        if before is None or state.tick != before[0]:
            follows = before is not None and state.tick == before[0] + 1
            since_ns = state.stamp_ns - before[1] if before is not None else 0
            self._tick_ms = since_ns / 1e6 if follows else NOT_A_NUMBER
            self._begun_ns = (state.tick, state.stamp_ns)
        yield Arms(moment, {name: instrument(arm) for name, arm in sorted(state.arms.items())})

    def _on_verdict(self, verdict: Verdict, moment: Moment) -> Iterator[Fact]:
        solved_tick, solve_ms = self._solve_ms
        begun_tick = -1 if self._begun_ns is None else self._begun_ns[0]
        yield Gauges(
            moment=moment,
            force_n=verdict.max_force_n,
            limit_n=verdict.limit_n,
            hard_limit_n=verdict.hard_limit_n,
            visibility=verdict.visibility,
            threshold=self._awareness.visible_fraction,
            tick_ms=self._tick_ms if begun_tick == verdict.tick else NOT_A_NUMBER,
            solve_ms=solve_ms if solved_tick == verdict.tick else NOT_A_NUMBER,
        )

    def _on_context(self, context: Context, moment: Moment) -> Iterator[Fact]:
        if len(context.blocks_m) != len(context.names):
            problem = f"{len(context.blocks_m)} for {len(context.names)} names"
            raise MalformedMessage(CONTEXT.key, "$.blocks_m", problem)
        self._block_names = tuple(context.names)
        self._blocks_rest_m = np.array(context.blocks_m, dtype=np.float64).reshape(-1, 3)
        self._fixed = frozenset(
            found[1] for fluent in context.fluents if (found := _FIXED.fullmatch(fluent))
        )
        self._anchors = None
        yield from self._blocks(moment)

    def _on_plan(self, plan: Plan, moment: Moment) -> Iterator[Fact]:
        self._plans += 1
        self._chosen = plan.target
        steps = " → ".join(action.text for action in plan.actions)
        heading = steps or ("no plan" if plan.no_plan is not None else "nothing is left to do")
        yield Sentence(
            moment,
            "info",
            "planner",
            f"plan {self._plans} ({plan.reason}, {plan.criterion}): {heading}",
        )
        for text in plan.explanation:
            yield Sentence(moment, "info", "planner", text)
        for text in plan.no_plan.sentences if plan.no_plan is not None else ():
            yield Sentence(moment, "warning", "planner", text)
        yield from self._blocks(moment)

    def _on_result(self, result: ActionResult, moment: Moment) -> Iterator[Fact]:
        fine = result.outcome == "succeeded"
        reason = f": {result.reason}" if result.reason else ""
        arguments = f"{result.arm},{result.block}" if result.block else result.arm
        text = f"{result.name}({arguments}) {result.outcome}{reason}"
        yield Sentence(moment, "info" if fine else "warning", "motion", text)

    def _on_status(self, status: TaskStatus, moment: Moment) -> Iterator[Fact]:
        if status.outcome and status.phase == "ended":
            level: Level = "info" if status.outcome == "success" else "warning"
            yield Sentence(moment, level, "executive", f"{status.outcome}: {status.reason}")
            for text in status.violations:
                yield Sentence(moment, "error", "executive", text)

    def _on_record(self, record: LogRecord, moment: Moment) -> Iterator[Fact]:
        fields = "".join(f", {name} = {value}" for name, value in record.fields.items())
        level: Level = "error" if record.level.lower() in ("error", "critical") else "warning"
        who = record.source.partition("/")[0]
        yield Sentence(moment, level, who, f"{record.event}{fields}")

    def _blocks(self, moment: Moment) -> Iterator[Fact]:
        if self._stage is None or not self._block_names or self._nodes_m is None:
            return
        if self._anchors is None:
            stage, rest_m = self._stage, self._blocks_rest_m
            self._anchors = bind(stage.rest_m, stage.surface, rest_m)
        bound: list[int] = self._anchors.points.tolist()
        names = tuple(self._block_names[index] for index in bound)
        places_m = self._anchors.places(self._nodes_m)
        yield Blocks(moment, names, places_m, tuple(self._kind(name) for name in names))

    def _kind(self, name: str) -> BlockKind:
        if name in self._held:
            return "held"
        if name == self._chosen:
            return "chosen"
        return "fixed" if name in self._fixed else "free"
