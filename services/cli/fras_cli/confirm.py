"""`fras run --confirm`: each plan is shown in the terminal, and done after a yes."""

import select
import sys
from collections.abc import Callable

from rich.console import Console

from fras_cli.plan_words import HOLDER, print_plan, told
from fras_cli.trial import TrialView
from fras_common.errors import FrasError
from fras_common.messages import ApproveRequest, DecisionReply, Plan, RejectRequest

__all__ = ["Confirmation", "NoTerminal", "require_terminal", "terminal_line"]

QUESTION = "do it? y: yes, n: make another plan, Ctrl-C: end the trial"
WHY = "why not? One line, for the audit log (Enter: none)"

Decide = Callable[[ApproveRequest | RejectRequest], DecisionReply]


class NoTerminal(FrasError):
    """There is nobody to ask."""


def require_terminal() -> None:
    """Refuse to ask where nobody can answer.

    Raises
    ------
    NoTerminal
    """
    if not sys.stdin.isatty():
        raise NoTerminal(
            "--confirm asks in the terminal, and standard input is none: set planner.confirm in "
            "the scenario instead, and decide at the page or with `fras approve`"
        )


def terminal_line() -> str | None:
    """Return a line that has been typed, None if there is none yet; waits for nothing.

    Raises
    ------
    EOFError
        None will ever come.
    """
    if not select.select([sys.stdin], [], [], 0.0)[0]:
        return None
    line = sys.stdin.readline()
    if not line:
        raise EOFError
    return line.strip()


class Confirmation:
    """Asks about each plan that waits, once, and goes on as is answered.

    Parameters
    ----------
    console : Console
    decide : callable
        Asks the planner to take a decision.
    line : callable
        Next line that a person has typed, see `terminal_line`.
    """

    def __init__(
        self, console: Console, decide: Decide, line: Callable[[], str | None] = terminal_line
    ) -> None:
        self._console = console
        self._decide = decide
        self._line = line
        self._plan: Plan | None = None
        self._wants_reason = False
        self._decided = ""
        self._hears = True

    def look(self, view: TrialView, pause: Callable[[], None]) -> bool:
        """Ask, or take an answer; True while a question stands, and nothing else may be drawn.

        Parameters
        ----------
        view : TrialView
        pause : callable
            Called before anything is written.
        """
        plan = self._waiting(view)
        if plan is None:
            if self._plan is not None:
                self._console.print("decided elsewhere", style="dim")
                self._plan = None
            return False
        if self._plan is None or self._plan.request_id != plan.request_id:
            self._plan, self._wants_reason = plan, False
            pause()
            print_plan(plan, self._console)
            self._console.print(QUESTION, highlight=False)
        try:
            line = self._line() if self._hears else None
        except EOFError:
            self._hears = False
            self._console.print("nobody answers here any more: decide with `fras approve`")
            return True
        if line is None:
            return True
        return self._take(line, plan, view)

    def _waiting(self, view: TrialView) -> Plan | None:
        task, plan = view.task, view.plan
        if task is None or plan is None or task.phase != "awaiting_approval":
            return None
        if plan.request_id != task.plan or plan.request_id == self._decided:
            return None
        return plan

    def _take(self, line: str, plan: Plan, view: TrialView) -> bool:
        """Do as the line says; whether the question still stands."""
        trial = view.task.trial if view.task is not None else ""
        if self._wants_reason:
            request = RejectRequest(trial=trial, plan=plan.request_id, by=HOLDER, reason=line[:400])
            return self._send(request, plan, "rejected")
        if line.lower() in {"y", "yes"}:
            approval = ApproveRequest(trial=trial, plan=plan.request_id, by=HOLDER)
            return self._send(approval, plan, "approved")
        if line.lower() in {"n", "no"}:
            self._wants_reason = True
            self._console.print(WHY, highlight=False)
        else:
            self._console.print(QUESTION, highlight=False)
        return True

    def _send(self, request: ApproveRequest | RejectRequest, plan: Plan, word: str) -> bool:
        reply = self._decide(request)
        told(reply, plan.request_id, word, self._console)
        self._wants_reason = False
        if reply.accepted:
            self._plan, self._decided = None, plan.request_id
        else:
            self._console.print(QUESTION, highlight=False)
        return not reply.accepted
