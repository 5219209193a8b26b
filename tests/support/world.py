"""A world that answers the executive with plain values: no bus, no clock, no clingo."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import msgspec

from fras_common.codec import content_digest
from fras_common.errors import FrasError
from fras_common.messages import (
    ActionResult,
    CancelReply,
    CloseReply,
    Context,
    DecisionReply,
    ExecuteReply,
    Monitored,
    NoPlan,
    OpenRequest,
    Plan,
    PlanDecision,
    PlannedAction,
    ResetReply,
    TargetReply,
    TaskRequest,
    TaskStatus,
)
from fras_common.scenario import PatientSection, PlannerSection, Scenario, resolve
from fras_common.topics import (
    CANCEL,
    EXECUTE,
    RECORDER_CLOSE,
    RECORDER_OPEN,
    SA_CONTEXT,
    SA_TARGET,
)
from fras_planner.approval import DecisionRequest, decision, judge
from fras_planner.effects import Accept, Ask, AwaitDecision, AwaitResult, Say
from fras_planner.endings import TaskAborted
from fras_planner.executive import Executive
from fras_planner.memory import PlanRequest, Resumption

RULES = {"domain.lp": "% rules\n"}
BLOCK, OTHER, THIRD = "b(1,1)", "b(2,2)", "b(3,3)"


def action(t: int, text: str, *expected: str) -> PlannedAction:
    name, _, arguments = text.partition("(")
    arm, _, block = arguments.removesuffix(")").partition(",")
    args = [arm, block] if block else [arm]
    return PlannedAction(t=t, text=text, name=name, args=args, expected=list(expected))


def pulling(block: str = BLOCK) -> list[PlannedAction]:
    return [
        action(1, f"reach(psm1,{block})", f"at(psm1,{block})"),
        action(2, f"grasp(psm1,{block})", f"in_hand(psm1,{block})"),
        action(3, f"pull(psm1,{block})"),
    ]


MOVING = [action(1, f"move(psm1,{OTHER})")]
RELEASING = [action(1, "release(psm1)", "-closed_gripper(psm1)"), *pulling(OTHER)]


@dataclass
class World:
    """Answers the executive: what is true after each action, and how each action ends."""

    plans: list[list[PlannedAction] | NoPlan]
    fluents: Callable[[str], list[str]] = lambda text: ["reachable(psm1,b(1,1))"]
    ends: dict[str, tuple[str, str]] = field(default_factory=dict[str, tuple[str, str]])
    refuse: dict[str, str] = field(default_factory=dict[str, str])
    faults: dict[str, FrasError] = field(default_factory=dict[str, FrasError])
    abort_at: str = ""
    planner: PlannerSection = field(default_factory=PlannerSection)
    patient: PatientSection | msgspec.UnsetType = msgspec.UNSET
    asked: list[str] = field(default_factory=list[str])
    requests: list[PlanRequest] = field(default_factory=list[PlanRequest])
    said: list[Plan | TaskStatus] = field(default_factory=list[Plan | TaskStatus])
    accepted: bool = False
    opened: OpenRequest | None = None
    verified: dict[int, list[str]] = field(default_factory=dict[int, list[str]])
    expected: list[list[str]] = field(default_factory=list[list[str]])
    evidence: dict[str, float] = field(default_factory=dict[str, float])
    decide: list[Callable[[str], DecisionRequest] | FrasError] = field(
        default_factory=list[Callable[[str], DecisionRequest] | FrasError]
    )
    replies: list[DecisionReply] = field(default_factory=list[DecisionReply])
    told: dict[str, Context] = field(default_factory=dict[str, Context])
    last: str = ""
    tick: int = 0

    @property
    def scenario(self) -> Scenario:
        return resolve(Scenario(planner=self.planner, patient=self.patient))

    def make_plan(self, context: Context, request: PlanRequest) -> Plan:
        self.requests.append(request)
        content = self.plans.pop(0)
        no_plan = content if isinstance(content, NoPlan) else None
        actions = [] if isinstance(content, NoPlan) else content
        return Plan(
            request_id=request.request_id,
            reason=request.reason,
            criterion="weighted",
            goal="visible",
            asp_digest="",
            ignore_ap=request.ignore_ap,
            tried=list(request.tried),
            actions=actions,
            rejected=list(request.rejected),
            target=next((one.args[1] for one in actions if one.name == "grasp"), ""),
            arm=actions[0].args[0] if actions else "",
            history=[],
            cost=[],
            models=1,
            ground_s=0.0,
            solve_s=0.0,
            explanation=[],
            no_plan=no_plan,
        )

    def new_executive(self, resumed: Resumption | None = None) -> Executive:
        request = TaskRequest(command="start", trial="t", scenario=self.scenario)
        return Executive(request, self.scenario, self.make_plan, self.verify, RULES, resumed)

    def run(self, executive: Executive | None = None) -> TaskStatus:
        executive = executive or self.new_executive()
        steps = executive.run()
        outcome: Any = None
        while True:
            try:
                if isinstance(outcome, FrasError):
                    effect = steps.throw(outcome)
                else:
                    effect = steps.send(outcome)
            except StopIteration:
                assert isinstance(self.said[-1], TaskStatus)
                return self.said[-1]
            if isinstance(effect, AwaitDecision):
                outcome = self.decision(executive, effect.plan)
            else:
                outcome = self.perform(effect)

    def decision(self, executive: Executive, plan: str) -> PlanDecision | FrasError:
        """Let the next person speak who is heard; each word is about the plan that waits."""
        assert executive.status.phase == "awaiting_approval"
        while True:
            said = self.decide.pop(0)
            if isinstance(said, FrasError):
                return said
            request = said(plan)
            reply = judge(request, executive.status, executive.proposal)
            self.replies.append(reply)
            if reply.accepted:
                return decision(request, reply)

    def verify(self, history: dict[int, list[str]]) -> list[str]:
        self.verified = history
        return [f"{len(history)} steps"]

    def perform(self, effect: Any) -> Any:
        if isinstance(effect, Say):
            self.said.append(effect.message)
            return msgspec.structs.replace(effect.message, seq=len(self.said))
        if isinstance(effect, Accept):
            self.accepted = True
            return None
        if isinstance(effect, AwaitResult):
            if self.abort_at and self.last.startswith(self.abort_at):
                self.abort_at = ""
                return TaskAborted("enough")
            outcome, reason = self.ends.get(self.last, ("succeeded", ""))
            self.tick += 10
            return ActionResult(
                tick=self.tick,
                goal_id=effect.goal_id,
                name="",
                arm="",
                block="",
                outcome=outcome,  # type: ignore[arg-type]
                reason=reason,
            )
        assert isinstance(effect, Ask)
        self.asked.append(effect.query.key)
        if effect.query.key in self.faults:
            return self.faults[effect.query.key]
        return self.answer(effect)

    def answer(self, ask: Ask) -> Any:
        request = ask.request
        if ask.query is SA_CONTEXT:
            assert request.min_tick == self.tick
            context = Context(
                tick=self.tick,
                trial="t",
                request_id=request.request_id,
                fluents=self.fluents(self.last),
                evidence={},
                names=[BLOCK, OTHER, THIRD],
                blocks_m=[],
                roi_m=(0.0, 0.0, 0.0),
                fixed_points_m=[],
                monitored=self.monitor(request.expected),
            )
            self.told[context.request_id] = context
            return context
        if ask.query is SA_TARGET:
            return TargetReply(position_m=(0.0, 0.0, 0.0))
        if ask.query is EXECUTE:
            self.last = f"{request.name}({request.arm}" + (
                f",{request.block})" if request.block else ")"
            )
            refusal = self.refuse.pop(self.last, "")
            return ExecuteReply(accepted=not refusal, reason=refusal)
        if ask.query is RECORDER_CLOSE:
            assert request.last_tick == self.tick
            return CloseReply(path="", messages=0, lost=0)
        if ask.query is CANCEL:
            return CancelReply(tick=self.tick)
        if ask.query is RECORDER_OPEN:
            self.opened = request
        return ResetReply(digest=content_digest("t", request.scenario, b""))

    def monitor(self, expected: list[str]) -> list[Monitored]:
        """Answer as situation awareness does: one entry for each expectation."""
        self.expected.append(expected)
        fluents = self.fluents(self.last)
        return [
            Monitored(
                atom=atom,
                holds=(atom.removeprefix("-") in fluents) != atom.startswith("-"),
                evidence=self.evidence,
            )
            for atom in expected
        ]


def after(**by_action: list[str]) -> Callable[[str], list[str]]:
    """Fluents after each action, by its name."""
    return lambda text: by_action.get(text.partition("(")[0], [])


def held(text: str) -> list[str]:
    """Where psm1 is and what it holds after an action that went as expected."""
    block = BLOCK if text.startswith("move") else text.partition(",")[2].removesuffix(")")
    return [f"at(psm1,{block})", f"in_hand(psm1,{block})"]


EXPOSED = after(
    reach=[f"at(psm1,{BLOCK})"],
    grasp=[f"in_hand(psm1,{BLOCK})"],
    pull=["visible_roi"],
)


def hidden_pull(*fluents: str) -> Callable[[str], list[str]]:
    """Reach and grasp as expected; the pull exposes nothing, the move does."""
    return lambda text: [*held(text), *fluents, *(["visible_roi"] * text.startswith("move"))]
