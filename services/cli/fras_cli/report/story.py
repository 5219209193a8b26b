"""What happened, in order: each plan with its actions, when they ran and how they ended.

The executive's statuses come from one publisher and so have an order; they say which action
belongs to which plan. Everything else is joined by goal id and tick.
"""

from dataclasses import dataclass
from typing import Literal

from fras_cli.report.trial import Trial
from fras_common.messages import Plan

ActionEnd = Literal[
    "succeeded", "failed", "interrupted", "aborted", "refused", "unfinished", "not begun"
]
PlanKind = Literal["plan", "re-plan", "resumed", "check", "no plan"]


@dataclass(frozen=True)
class ActionStory:
    """One action of a plan.

    Parameters
    ----------
    text, name, arm, block : str
        As planned; block is empty where the action has none.
    goal_id : str
        Empty if it was not begun.
    begin_s, end_s : float
        Simulated time [s]; equal where no tick was spent on it.
    end : str
        How it ended.
    reason : str
        The result's reason; empty for success.
    """

    text: str
    name: str
    arm: str
    block: str
    goal_id: str
    begin_s: float
    end_s: float
    end: ActionEnd
    reason: str


@dataclass(frozen=True)
class PlanStory:
    """One plan and what became of it.

    Parameters
    ----------
    number : int
        From 1.
    kind : {"plan", "re-plan", "resumed", "check", "no plan"}
        `check`: the goal was found reached, nothing is left to do. `resumed`: planned anew after
        a person's hold or rejection, which is no re-plan.
    replan : int
        Which re-plan it is, from 1; 0 if none.
    at_s : float
        Simulated time at which it was made [s]; time stands still meanwhile.
    """

    number: int
    kind: PlanKind
    replan: int
    at_s: float
    plan: Plan
    actions: tuple[ActionStory, ...]


@dataclass(frozen=True)
class _Begun:
    """An action that the executive began: of which plan, and its text."""

    plan: int
    goal_id: str
    text: str


def tell(trial: Trial) -> tuple[PlanStory, ...]:
    """Join plans, statuses, results and ticks of a trial."""
    begun = _begun(trial)
    spans = _spans(trial)
    stories: list[PlanStory] = []
    now_s, replans = 0.0, 0
    for number, plan in enumerate(trial.plans, start=1):
        kind = _kind(plan, number)
        replans += kind == "re-plan"
        actions: list[ActionStory] = []
        at_s = now_s
        own = [item for item in begun if item.plan == number]
        for index, planned in enumerate(plan.actions):
            goal_id = own[index].goal_id if index < len(own) else ""
            begin_s, now_s = spans.get(goal_id, (now_s, now_s))
            end, reason = _end(trial, goal_id)
            actions.append(
                ActionStory(
                    text=planned.text,
                    name=planned.name,
                    arm=planned.args[0] if planned.args else "",
                    block=planned.args[1] if len(planned.args) > 1 else "",
                    goal_id=goal_id,
                    begin_s=begin_s,
                    end_s=now_s,
                    end=end,
                    reason=reason,
                )
            )
        replan = replans if kind == "re-plan" else 0
        stories.append(PlanStory(number, kind, replan, at_s, plan, tuple(actions)))
    return tuple(stories)


def _kind(plan: Plan, number: int) -> PlanKind:
    if plan.no_plan is not None:
        return "no plan"
    if not plan.actions:
        return "check"
    if number == 1:
        return "plan"
    kind = plan.reason.partition(":")[0]
    return "resumed" if kind in ("hold", "restart", "rejected") else "re-plan"


def _begun(trial: Trial) -> list[_Begun]:
    found: dict[str, _Begun] = {}
    for status in trial.statuses:
        if status.phase == "acting" and status.goal_id:
            item = _Begun(plan=status.plans, goal_id=status.goal_id, text=status.action)
            found.setdefault(status.goal_id, item)
    return list(found.values())


def _spans(trial: Trial) -> dict[str, tuple[float, float]]:
    """Begin and end of each goal [s]: its first tick began one dt earlier."""
    spans: dict[str, tuple[float, float]] = {}
    for state in trial.robot:
        if state.goal_id:
            begin_s, _ = spans.get(state.goal_id, ((state.tick - 1) * trial.dt_s, 0.0))
            spans[state.goal_id] = (begin_s, state.tick * trial.dt_s)
    return spans


def _end(trial: Trial, goal_id: str) -> tuple[ActionEnd, str]:
    if not goal_id:
        return "not begun", ""
    for result in trial.results:
        if result.goal_id == goal_id:
            return result.outcome, result.reason
    if any(state.goal_id == goal_id for state in trial.robot):
        return "unfinished", ""
    return _refusal(trial, goal_id)


def _refusal(trial: Trial, goal_id: str) -> tuple[ActionEnd, str]:
    """Tell refused from cut off: after a refusal the executive planned again."""
    plan_of = {item.goal_id: item.plan for item in _begun(trial)}[goal_id]
    if plan_of < len(trial.plans):
        _, _, reason = trial.plans[plan_of].reason.partition("refused: ")
        return "refused", reason
    return "unfinished", ""
