"""`fras log verify`: what a trial did against the safety specifications, from its log alone."""

import importlib
import re
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from fras_cli.report import Trial, read_trial
from fras_cli.run import EXIT_NOT_SUCCESS
from fras_common.errors import FrasError
from fras_common.executed import history_step
from fras_common.messages import Plan
from fras_common.service.extras import require_extra


class LogIncomplete(FrasError):
    """A log that lacks what led to an action. Attributes: ``goal_id``."""


def verify_log(path: Path, asp_dir: Path | None, console: Console) -> int:
    """Print which specifications were broken; 0 if none was in a whole trial, else 1.

    Raises
    ------
    LogIncomplete
        If the context or the plan behind an action is not in the log.
    """
    with require_extra("planner"):
        offline = importlib.import_module("fras_planner.offline")
    trial = read_trial(path)
    history = executed_history(trial)
    broken: list[str] = offline.verify_history(history, asp_dir)
    for sentence in broken:
        console.print(escape(sentence))
    said = trial.ending.violations if trial.ending is not None else None
    if trial.damage:
        console.print(f"The log is damaged: {escape(trial.damage)}")
    elif said is None:
        console.print("The log ends before the trial did.")
    elif list(said) != broken:
        told = "; ".join(said) or "that all were kept"
        console.print(f"The planner itself said otherwise: {escape(told)}")
    is_whole = not trial.damage and said is not None
    kept = "all specifications kept" if is_whole else "no specification broken by these"
    verdict = f"specifications broken: {len(broken)}" if broken else kept
    console.print(f"{len(history)} actions verified: {verdict}.")
    return 0 if is_whole and list(said or []) == broken == [] else EXIT_NOT_SUCCESS


def executed_history(trial: Trial) -> dict[int, list[str]]:
    """Return for each action carried out what was sensed and asked for before it, and the action.

    Action ``gK`` follows on context ``cK``: the executive asks for one before each, and numbers
    both alike.
    """
    contexts = {context.request_id: context for context in trial.contexts}
    history: dict[int, list[str]] = {}
    for result in trial.results:
        number = _number("g", result.goal_id)
        before = contexts.get(f"c{number}")
        plan = _plan_of(number, trial.plans)
        if before is None or plan is None:
            raise LogIncomplete(
                f"{trial.path}: what led to action {result.goal_id} is not in the log",
                goal_id=result.goal_id,
            )
        arguments = f"{result.arm},{result.block}" if result.block else result.arm
        history[number] = history_step(f"{result.name}({arguments})", before, plan)
    return history


def _plan_of(number: int, plans: tuple[Plan, ...]) -> Plan | None:
    made = [plan for plan in plans if 0 < _number("c", plan.request_id) <= number]
    return made[-1] if made else None


def _number(kind: str, name: str) -> int:
    """Return the number in a name of the executive's; 0 for another's."""
    found = re.fullmatch(kind + "([0-9]+)", name)
    return int(found[1]) if found else 0
