"""How an action ended, and what follows from that."""

from dataclasses import dataclass
from typing import Literal

from fras_common.errors import FrasError
from fras_common.messages import ActionResult, Context, Plan, PlannedAction
from fras_planner.approval import REJECTED
from fras_planner.deviation import first_deviation

ScenarioKind = Literal["A", "B", "C"]

RESTART = "restart"
# Reasons for which a new plan is no failure of the one before.
NO_FAILURE = ("hold", RESTART)


class TaskAborted(FrasError):
    """Someone ended the trial; thrown into the executive at whatever it waits for."""


class ActionAborted(FrasError):
    """Motion gave an action up, and with it the trial."""


class PeerLost(FrasError):
    """A service that the executive waits for has gone."""

    service: str


class DigestMismatch(FrasError):
    """A service understood the scenario differently."""


@dataclass(frozen=True)
class Ended:
    """An action that ended, and what is true now; no result if motion refused it."""

    action: PlannedAction
    result: ActionResult | None
    refusal: str
    context: Context

    @property
    def by_restart(self) -> bool:
        """Whether nothing speaks against the action but that motion started again."""
        reason = self.refusal if self.result is None else self.result.reason
        return reason == RESTART


def is_failure(reason: str) -> bool:
    """Whether a reason to plan anew speaks against the plan before, and so is counted."""
    return reason not in NO_FAILURE and reason.partition(":")[0] != REJECTED


def kind_with(kind: ScenarioKind, plan: Plan) -> ScenarioKind:
    """Return what kind of trial it is once a later plan is done, too."""
    names = {action.name for action in plan.actions}
    if "release" in names:
        return "C"
    return "B" if "move" in names and kind == "A" else kind


def reason_to_replan(ended: Ended) -> str:
    """Return why an action's end asks for a new plan, or nothing."""
    result = ended.result
    if ended.by_restart:
        return RESTART
    if result is None:
        return f"refused: {ended.refusal}"
    if result.outcome == "interrupted":
        return "hold" if result.reason == "hold" else "force"
    if result.outcome == "failed":
        return result.reason
    return first_deviation(ended.action, ended.context.monitored)
