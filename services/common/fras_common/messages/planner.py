"""What the planner and its executive publish and answer."""

from typing import Literal

from fras_common.messages.base import Header, Wire
from fras_common.scenario.model import Scenario

Outcome = Literal["", "success", "no_plan", "aborted", "failed"]
TaskPhase = Literal["idle", "resetting", "planning", "acting", "ended"]


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


class TaskRequest(Wire, frozen=True, kw_only=True):
    """Start a trial (scenario by value, already resolved) or abort the one that runs."""

    command: Literal["start", "abort"]
    trial: str
    scenario: Scenario | None = None
    mesh: bytes = b""
    out_dir: str = ""
    started_ns: int = 0
    reason: str = ""


class TaskReply(Wire, frozen=True, kw_only=True):
    """Whether the request was taken, and if not, why."""

    accepted: bool
    reason: str


class TaskStatus(Header, frozen=True, kw_only=True):
    """The executive's whole memory; latched.

    A trial ends with phase `ended`; once its log is closed the phase is `idle`, and another one
    may start. `violations` are the safety specifications (`asp/verify.lp`) that what was done
    broke, in words; told at the end.
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
