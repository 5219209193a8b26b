"""What an executive remembers, and what one that starts again makes of it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import msgspec

from fras_common.executed import history_step
from fras_common.messages import (
    Context,
    DoneAction,
    Plan,
    PlannedAction,
    TaskRequest,
    TaskStatus,
)
from fras_planner.approval import Proposal


class PlanRequest(msgspec.Struct, frozen=True, kw_only=True):
    """What a plan depends on beside the context."""

    request_id: str
    reason: str
    ignore_ap: bool
    tried: tuple[str, ...]
    rejected: tuple[str, ...] = ()

    @classmethod
    def of(cls, plan: Plan) -> "PlanRequest":
        """Return what a plan was made with."""
        return cls(
            request_id=plan.request_id,
            reason=plan.reason,
            ignore_ap=plan.ignore_ap,
            tried=tuple(plan.tried),
            rejected=tuple(plan.rejected),
        )


@dataclass(frozen=True)
class Resumption:
    """What an executive of before has left.

    Parameters
    ----------
    status : TaskStatus
        The last that it said.
    started : bool
        Whether motion has taken the goal of that status, so that a result comes or has come.
    contexts, plans : mapping
        By request id.
    request : TaskRequest or None
        The start of the trial; None if it is not remembered, and the trial can only be ended.
    """

    status: TaskStatus
    started: bool = False
    contexts: Mapping[str, Context] = field(default_factory=dict[str, Context])
    plans: Mapping[str, Plan] = field(default_factory=dict[str, Plan])
    request: TaskRequest | None = None

    def history(self, done: Iterable[DoneAction]) -> dict[int, list[str]]:
        """Return what was done, and upon what, by goal; where that is still known."""
        known: dict[int, list[str]] = {}
        for one in done:
            before, plan = self.contexts.get(one.context), self.plans.get(one.plan)
            if before is not None and plan is not None:
                known[one.goal] = history_step(one.action, before, plan)
        return known

    @property
    def followed(self) -> tuple[Plan, Context] | None:
        """The plan that is followed, and what it was made from; None if either is forgotten."""
        plan = self.plans.get(self.status.plan)
        context = self.contexts.get(self.status.plan)
        return (plan, context) if plan is not None and context is not None else None

    @property
    def proposal(self) -> Proposal | None:
        """The plan that waits for a person's approval; None if none does, or it is forgotten."""
        followed = self.followed
        if self.status.phase != "awaiting_approval" or followed is None:
            return None
        return Proposal(*followed)


def first_status(trial: str) -> TaskStatus:
    """Return the memory of an executive that begins."""
    return TaskStatus(
        trial=trial,
        phase="resetting",
        action="",
        goal_id="",
        tried=[],
        plans=0,
        replans=0,
        scenario_kind="A",
        actions=[],
        outcome="",
        reason="",
        violations=[],
    )


def planned(plan: Plan | None, text: str) -> PlannedAction:
    """Return an action by its plan; without the plan nothing is expected of it."""
    found = [one for one in plan.actions if one.text == text] if plan is not None else []
    if found:
        return found[0]
    name, _, arguments = text.removesuffix(")").partition("(")
    arm, _, block = arguments.partition(",")
    return PlannedAction(
        t=0, text=text, name=name, args=[arm, block] if block else [arm], expected=[]
    )
