"""What a person may decide on a plan that waits: judged on plain values, no bus and no clock."""

from collections.abc import Iterable
from dataclasses import dataclass

from fras_common.messages import (
    ApproveRequest,
    Context,
    DecisionReply,
    Plan,
    PlanDecision,
    RejectRequest,
    TaskStatus,
)
from fras_common.messages.planner import DecisionRefusal
from fras_common.topics import ARMS, PEOPLE

__all__ = ["DecisionRequest", "Proposal", "decision", "judge", "rejected", "rejection"]

DecisionRequest = ApproveRequest | RejectRequest
REJECTED = "rejected"


@dataclass(frozen=True)
class Proposal:
    """A plan that waits for a person, and the context that it was made from."""

    plan: Plan
    context: Context


def judge(
    request: DecisionRequest, status: TaskStatus | None, proposal: Proposal | None
) -> DecisionReply:
    """Say whether a decision is taken, and what a rejection excludes.

    Parameters
    ----------
    request : ApproveRequest or RejectRequest
    status : TaskStatus or None
        The executive's memory; None if no trial is under way.
    proposal : Proposal or None
        What waits; None if nothing does.
    """
    if request.by not in PEOPLE:
        people = " and ".join(PEOPLE)
        return _refused("wrong_client", f"{request.by!r} does not decide on plans: {people} do")
    if status is None:
        return _refused("no_trial", "no trial is under way")
    if request.trial != status.trial:
        return _refused("another_trial", f"trial {status.trial!r} runs, not {request.trial!r}")
    is_approval = isinstance(request, ApproveRequest)
    for done in status.decisions:
        if (done.plan, done.approved) == (request.plan, is_approval):
            # Asked again because the answer was lost.
            return DecisionReply(accepted=True, excluded=done.excluded)
    if proposal is None:
        return _refused("not_waiting", "no plan waits for a decision")
    if request.plan != proposal.plan.request_id:
        waits = proposal.plan.request_id
        return _refused("another_plan", f"plan {waits!r} waits, not {request.plan!r}")
    if isinstance(request, ApproveRequest):
        return DecisionReply(accepted=True)
    return _rejection(request, proposal)


def decision(request: DecisionRequest, reply: DecisionReply) -> PlanDecision:
    """Put a decision that was taken into the executive's memory."""
    return PlanDecision(
        plan=request.plan,
        approved=isinstance(request, ApproveRequest),
        by=request.by,
        reason=request.reason if isinstance(request, RejectRequest) else "",
        excluded=reply.excluded,
    )


def rejected(status: TaskStatus) -> tuple[str, ...]:
    """All blocks and arms that were excluded, in the order in which they were."""
    return tuple(dict.fromkeys(one for done in status.decisions for one in done.excluded))


def rejection(done: PlanDecision) -> str:
    """Reason to plan anew after a rejection."""
    return f"{REJECTED}: {done.reason}" if done.reason else REJECTED


def _rejection(request: RejectRequest, proposal: Proposal) -> DecisionReply:
    plan, context = proposal.plan, proposal.context
    asked = ["".join(name.split()) for name in request.exclude]
    known = {*ARMS, *context.names}
    if unknown := [name for name in asked if name not in known]:
        text = f"{unknown[0]!r} is neither a block of this scene nor one of {', '.join(ARMS)}"
        return _refused("unknown_name", text)
    wanted = asked or ([plan.target] if plan.target else _in_grip(plan.arm, context.fluents))
    # Each rejection leaves fewer candidates, so that there is an end to them.
    fresh = [name for name in dict.fromkeys(wanted) if name not in plan.rejected]
    if not fresh:
        text = "nothing of the plan is left to exclude: approve it, or abort the trial"
        if asked:
            text = "all of that is excluded already: name something else"
        return _refused("nothing_to_exclude", text)
    return DecisionReply(accepted=True, excluded=fresh)


def _in_grip(arm: str, fluents: Iterable[str]) -> list[str]:
    """Blocks in a gripper: on a fine grid, to leave one of them would be to hold it again."""
    grip = f"in_hand({arm},"
    return sorted(atom[len(grip) : -1] for atom in fluents if atom.startswith(grip))


def _refused(reason: DecisionRefusal, text: str) -> DecisionReply:
    return DecisionReply(accepted=False, reason=reason, text=text)
