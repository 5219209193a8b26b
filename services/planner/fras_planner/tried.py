"""Which blocks are no candidates any more: the one thing that planning has to remember."""

from collections.abc import Iterable
from dataclasses import dataclass

from fras_common.messages import ActionResult, PlannedAction


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

    A block is ruled out when it could not be reached or grasped; when the hard limit was crossed
    with it in hand; when a move of it did not expose; and when a pull of it did not expose and it
    is fixed or was chosen with the attachment points ignored.

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
    if result is None or result.outcome == "failed":
        return [target] if action.name in {"reach", "grasp"} else []
    if held is None or result.reason == "hold":
        return []
    holds = set(fluents)
    hopeless = held.ignored_ap or f"fixed({held.block})" in holds
    in_vain = "visible_roi" not in holds and (
        action.name == "move" or (action.name == "pull" and hopeless)
    )
    if result.reason != "force_hard" and not in_vain:
        return []
    # On a fine grid a gripper spans several blocks; to try its neighbour would be to try it again.
    grip = f"in_hand({action.args[0]},"
    spanned = {atom[len(grip) : -1] for atom in holds if atom.startswith(grip)}
    return [held.block, *sorted(spanned - {held.block})]
