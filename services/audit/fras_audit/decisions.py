"""What other rules would have decided in the situations that a log records."""

from dataclasses import dataclass
from pathlib import Path

from fras_audit.planner import context_of, maker_of
from fras_audit.recorded import Recorded
from fras_common.errors import FrasError
from fras_common.messages import Plan
from fras_common.topics import PLAN
from fras_planner.knowledge import load_knowledge
from fras_planner.memory import PlanRequest


@dataclass(frozen=True)
class Decision:
    """What other rules would have done where a plan was made.

    Parameters
    ----------
    request_id : str
        The context's.
    tick : int
    reason : str
        Why a plan was made.
    recorded, other : tuple of str
        Actions; none where the goal was reached or there was no plan.
    recorded_why, other_why : tuple of str
        The reasons, in words.
    """

    request_id: str
    tick: int
    reason: str
    recorded: tuple[str, ...]
    other: tuple[str, ...]
    recorded_why: tuple[str, ...]
    other_why: tuple[str, ...]

    @property
    def differs(self) -> bool:
        """Whether the other rules would have done something else."""
        return self.recorded != self.other


@dataclass(frozen=True)
class Decisions:
    """Every decision of a log, and how many could not be asked for again."""

    asp_digest: str
    all: tuple[Decision, ...]
    skipped: int

    @property
    def differing(self) -> tuple[Decision, ...]:
        """Those in which the other rules differ."""
        return tuple(one for one in self.all if one.differs)


def decide_by(recorded: Recorded, asp_dir: Path) -> Decisions:
    """Plan each recorded context by other rules, with all else as it was.

    Each context is that of the trial as it went: what would have come of another decision is not
    in the log.

    Raises
    ------
    KnowledgeFault
        The rules can't be used.
    """
    knowledge = load_knowledge(asp_dir)
    # Before any plan, so that rules without the trial's criterion are refused as a whole.
    knowledge.preference_file(recorded.scenario.planner.criterion)
    maker = maker_of(recorded, knowledge)
    found: list[Decision] = []
    skipped = 0
    for plan in recorded.of(PLAN):
        context = context_of(recorded, plan)
        if context is None:
            skipped += 1
            continue
        try:
            other = maker(context, PlanRequest.of(plan))
        except FrasError as error:
            found.append(_decision(plan, ("refused",), (str(error),)))
            continue
        found.append(_decision(plan, _actions(other), tuple(other.explanation)))
    return Decisions(knowledge.digest, tuple(found), skipped)


def _decision(plan: Plan, other: tuple[str, ...], why: tuple[str, ...]) -> Decision:
    return Decision(
        request_id=plan.request_id,
        tick=plan.tick,
        reason=plan.reason,
        recorded=_actions(plan),
        other=other,
        recorded_why=tuple(plan.explanation),
        other_why=why,
    )


def _actions(plan: Plan) -> tuple[str, ...]:
    if plan.no_plan is not None:
        return ("no plan",)
    return tuple(action.text for action in plan.actions)
