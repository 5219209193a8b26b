"""What an action was done upon, as the safety specifications read it."""

from fras_common.messages import Context, Plan
from fras_common.topics import ARMS


def history_step(action: str, before: Context, plan: Plan) -> list[str]:
    """Return the action, what was sensed before it, and what its plan was asked to heed.

    Parameters
    ----------
    action : str
        As the plan has it, ``pull(psm1,b(3,2))``.
    before : Context
        The latest before it.
    plan : Plan
        The one that it belongs to.
    """
    options = [f"tried({block})" for block in plan.tried]
    options += [f"{'barred' if name in ARMS else 'rejected'}({name})" for name in plan.rejected]
    if plan.ignore_ap:
        options.append("ignore_ap")
    return [action, *before.fluents, *options]
