"""Which blocks are no candidates any more: the one thing that planning has to remember."""

from collections.abc import Iterable
from dataclasses import dataclass

from fras_common.messages import ActionResult, PlannedAction
from fras_planner.endings import NO_FAILURE


@dataclass(frozen=True)
class Held:
    """The block in hand, and whether it was chosen with the attachment points ignored."""

    block: str
    ignored_ap: bool


def newly_tried(
    action: PlannedAction,
    result: ActionResult | None,
    fluents: Iterable[str],
    held: Held | None,
) -> list[str]:
    """Blocks that the end of `action` rules out.

    A block is ruled out when it could not be reached or grasped; when motion refused to pull or
    move it; when the hard limit was crossed with it in hand; when a move of it did not expose; and
    when a pull of it did not expose and it is fixed or was chosen with the attachment points
    ignored.

    Parameters
    ----------
    action : PlannedAction
    result : ActionResult or None
        None if motion refused the action.
    fluents : iterable of str
        The context after it.
    held : Held or None
        What was in hand when it began.
    """
    target = action.args[1] if len(action.args) > 1 else ""
    holds = set(fluents)
    if action.name in {"reach", "grasp"} and (result is None or result.outcome == "failed"):
        return [target]
    if held is None or action.name == "release":
        return []
    if result is None:
        return _in_grip(action.args[0], held, holds)
    if result.outcome == "failed" or result.reason in NO_FAILURE:
        return []
    hopeless = held.ignored_ap or f"fixed({held.block})" in holds
    in_vain = "visible_roi" not in holds and (
        action.name == "move" or (action.name == "pull" and hopeless)
    )
    if result.reason != "force_hard" and not in_vain:
        return []
    return _in_grip(action.args[0], held, holds)


def _in_grip(arm: str, held: Held, holds: set[str]) -> list[str]:
    """Blocks in a gripper: on a fine grid, to try the neighbour would be to try it again."""
    grip = f"in_hand({arm},"
    spanned = {atom[len(grip) : -1] for atom in holds if atom.startswith(grip)}
    return [held.block, *sorted(spanned - {held.block})]
