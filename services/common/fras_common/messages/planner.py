"""What the planner and its executive publish and answer."""

from typing import Annotated, Literal

import msgspec

from fras_common.messages.base import Header, TrialName, Wire
from fras_common.scenario.model import Scenario

Outcome = Literal["", "success", "no_plan", "aborted", "failed"]
TaskPhase = Literal["idle", "resetting", "planning", "awaiting_approval", "acting", "ended"]
DecisionRefusal = Literal[
    "",
    "wrong_client",
    "no_trial",
    "another_trial",
    "another_plan",
    "not_waiting",
    "unknown_name",
    "nothing_to_exclude",
]
Spoken = Annotated[str, msgspec.Meta(max_length=400)]
"""What a person says; it stands in logs and on screens."""


class PlannedAction(Wire, frozen=True, kw_only=True):
    """One action of a plan; `expected` is what must hold after it (a leading - means: not)."""

    t: int
    text: str
    name: str
    args: list[str]
    expected: list[str]


class HistoryStep(Wire, frozen=True, kw_only=True):
    """Every atom that holds at step `t` of a plan, the action taken at it first."""

    t: int
    atoms: list[str]


class NoPlan(Wire, frozen=True, kw_only=True):
    """Why no plan exists: names of the rules that together forbid one, and the same in words."""

    core: list[str]
    sentences: list[str]


class Plan(Header, frozen=True, kw_only=True):
    """A plan with everything that went into it and the reasons for it.

    Attributes
    ----------
    asp_digest : str
        SHA-256 over the rule files that made it.
    rejected : list of str
        Blocks and arms that a person has excluded from grasping.
    """

    request_id: str
    reason: str
    criterion: str
    goal: str
    asp_digest: str
    ignore_ap: bool
    tried: list[str]
    actions: list[PlannedAction]
    target: str
    arm: str
    history: list[HistoryStep]
    cost: list[int]
    models: int
    ground_s: float
    solve_s: float
    explanation: list[str]
    no_plan: NoPlan | None
    rejected: list[str] = msgspec.field(default_factory=list[str])


class TaskRequest(Wire, frozen=True, kw_only=True):
    """Start a trial (scenario by value, already resolved) or abort the one that runs."""

    command: Literal["start", "abort"]
    trial: TrialName
    scenario: Scenario | None = None
    mesh: bytes = b""
    out_dir: str = ""
    started_ns: int = 0
    reason: str = ""


class TaskReply(Wire, frozen=True, kw_only=True):
    """Whether the request was taken, and if not, why."""

    accepted: bool
    reason: str


class DoneAction(Wire, frozen=True, kw_only=True):
    """An action that has ended: its goal's number, and by which context and plan it was done."""

    goal: int
    action: str
    context: str
    plan: str


class PlanDecision(Wire, frozen=True, kw_only=True):
    """What a person decided on a plan.

    Attributes
    ----------
    plan : str
        Its request id.
    by : str
        Where the person stands, `cli` or `monitor`.
    reason : str
        Why it was rejected, in the person's words.
    excluded : list of str
        Blocks and arms that no later plan of the trial grasps, or grasps with.
    """

    plan: str
    approved: bool
    by: str
    reason: str = ""
    excluded: list[str] = msgspec.field(default_factory=list[str])


class TaskStatus(Header, frozen=True, kw_only=True):
    """The executive's whole memory: one that starts again goes on from it; latched.

    A trial ends with phase `ended`; once its log is closed the phase is `idle`, and another one
    may start. In phase `awaiting_approval` nothing moves until a person approves or rejects the
    plan whose request id is `plan`. `violations` are the safety specifications (`asp/verify.lp`)
    that what was done broke, in words; told at the end.

    Attributes
    ----------
    goals, contexts : int
        How many there have been; the last ones are `g<goals>` and `c<contexts>`.
    plan : str
        Request id of the plan that is followed.
    held : str
        The block in hand; `held_ignored_ap`: its plan ignored the attachment points.
    done : list of DoneAction
        That of the goal under way comes to them when it has ended.
    decisions : list of PlanDecision
        Of each plan that a person has approved or rejected, in their order.
    """

    phase: TaskPhase
    action: str
    goal_id: str
    tried: list[str]
    plans: int
    replans: int
    scenario_kind: Literal["A", "B", "C"]
    actions: list[str]
    outcome: Outcome
    reason: str
    violations: list[str]
    goals: int = 0
    contexts: int = 0
    plan: str = ""
    held: str = ""
    held_ignored_ap: bool = False
    done: list[DoneAction] = msgspec.field(default_factory=list[DoneAction])
    decisions: list[PlanDecision] = msgspec.field(default_factory=list[PlanDecision])


class ApproveRequest(Wire, frozen=True, kw_only=True):
    """Let a plan that waits be done; `plan` is its request id, `by` where the person stands."""

    trial: TrialName
    plan: str
    by: str


class RejectRequest(Wire, frozen=True, kw_only=True):
    """Have another plan made than the one that waits.

    Attributes
    ----------
    reason : str
        Why, in the person's words.
    exclude : list of str
        Blocks, `b(3,2)`, and arms, `psm1`, that no later plan grasps, or grasps with. By default
        the block that the plan grasps, or the tissue in hand that it pulls or moves.
    """

    trial: TrialName
    plan: str
    by: str
    reason: Spoken
    exclude: Annotated[list[str], msgspec.Meta(max_length=2000)] = msgspec.field(
        default_factory=list[str]
    )


class DecisionReply(Wire, frozen=True, kw_only=True):
    """Whether the decision was taken, and if not, why.

    Attributes
    ----------
    reason : str
        Name of what stands against it; empty else.
    text : str
        The same in words.
    excluded : list of str
        What a rejection has excluded.
    """

    accepted: bool
    reason: DecisionRefusal = ""
    text: str = ""
    excluded: list[str] = msgspec.field(default_factory=list[str])


class WhyNotRequest(Wire, frozen=True, kw_only=True):
    """Ask why the latest plan does not grasp a block, or does not begin with an action."""

    question: str


class WhyNotReply(Wire, frozen=True, kw_only=True):
    """The answer in words, and the rules that forbid it, if any do; for which plan it holds."""

    question: str
    trial: str
    request_id: str
    rules: list[str]
    sentences: list[str]
