"""A plan that waits, and what was decided on it, as a person reads them in the terminal."""

from rich.console import Console
from rich.markup import escape

from fras_common.messages import DecisionReply, Plan

HOLDER = "cli"


def told(reply: DecisionReply, plan: str, word: str, console: Console) -> bool:
    """Print what became of a decision; whether it was taken."""
    if not reply.accepted:
        console.print(escape(f"not {word} ({reply.reason}): {reply.text}"), style="bold red")
        return False
    excluded = f", excluded from now on: {', '.join(reply.excluded)}" if reply.excluded else ""
    console.print(escape(f"plan {plan} {word}{excluded}"), soft_wrap=True)
    return True


def print_plan(plan: Plan, console: Console) -> None:
    """Print what a plan would do, and why."""
    done = " → ".join(action.text for action in plan.actions)
    console.print(escape(f"plan {plan.request_id}: {done}"), style="bold", soft_wrap=True)
    for sentence in plan.explanation:
        console.print(escape(f"  {sentence}"), soft_wrap=True)
