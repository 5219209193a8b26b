"""`fras log verify`: whether a log is what was recorded, and what its trial did, from it alone."""

import importlib
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape

from fras_cli.progress import read_progress
from fras_cli.report import Trial, read_trial
from fras_cli.run import EXIT_NOT_SUCCESS
from fras_common.errors import FrasError
from fras_common.executed import history_step
from fras_common.extras import require_extra
from fras_common.messages import Plan
from fras_log import Verification, verify_file
from fras_log.attachments import read_attachments, rules_in
from fras_log.keys import trusted_keys

HEAD = re.compile("[0-9a-f]{64}")


class LogIncomplete(FrasError):
    """A log that lacks what led to an action. Attributes: ``goal_id``."""


class NotAHead(FrasError):
    """What was given as a head can't be one. Attributes: ``head``."""


def verify_log(
    path: Path,
    asp_dir: Path | None,
    console: Console,
    *,
    keys: Sequence[Path] = (),
    head: str = "",
) -> int:
    """Print what is wrong with a log and with what was done in it.

    Parameters
    ----------
    path : Path
    asp_dir : Path or None
        Specifications other than those attached to the log, or, without any, than FRAS's own.
    console : Console
    keys : sequence of Path
        Public keys whose signatures are trusted; this machine's own by default.
    head : str
        Head of the chain that was noted when the log was closed.

    Returns
    -------
    int
        0 if the file is intact and all specifications were kept in a whole trial, else 1.

    Raises
    ------
    NotAHead
        A head is given, and not whole.
    NoSuchLog, NotAnMcap, ForeignLog, BadKey
        There is nothing to verify, or nothing to verify it with.
    LogIncomplete
        If the context or the plan behind an action is not in an intact log.
    """
    noted = head.strip().lower()
    if noted and not HEAD.fullmatch(noted):
        raise NotAHead(
            f"--head {head!r} has {len(noted)} characters: a head is 64 hexadecimal digits, all of "
            "those that stood at the trial's end",
            head=head,
        )
    trusted = trusted_keys(keys)
    with read_progress(console, "verifying") as progress:
        found = verify_file(path, trusted, noted, progress)
    _print_file(found, console)
    try:
        kept = _verify_trial(path, asp_dir, console)
    except FrasError as error:
        if found.intact:
            raise
        console.print(f"What was done can't be verified: {escape(str(error))}")
        kept = False
    return 0 if found.intact and kept else EXIT_NOT_SUCCESS


def _print_file(found: Verification, console: Console) -> None:
    for finding in found.findings:
        console.print(escape(str(finding)), style="red", soft_wrap=True)
    for kind, count in found.beyond.items():
        console.print(f"{kind}: {count} more", style="red")
    console.print(f"{found.messages} messages, head {found.head}", soft_wrap=True)
    for name in found.unfinished:
        text = f"{name} was never finished: the recorder of the next file found it so, and went on."
        console.print(escape(text), soft_wrap=True)
    if found.authentic:
        console.print(f"The log is authentic: intact, and signed with key {found.signed_by}.")
    elif found.intact and found.signed_by:
        console.print(
            f"The log is intact. It is signed with key {found.signed_by}, which is not among those "
            "trusted here: give that machine's public key with --key."
        )
    elif found.intact:
        console.print("The log is intact. It is not signed, so nobody vouches for who wrote it.")
    elif found.only("end"):
        console.print(
            f"The log was never closed, or was cut: its chain vouches for the {found.chained} "
            "messages up to there. `fras log recover` makes a whole log of them."
        )
    elif found.only("version"):
        console.print("What could be checked is as it was recorded; a newer FRAS checks the rest.")
    elif found.only("sequence", "schema", "interlock"):
        console.print("The log is what was recorded; what was recorded is not as it should be.")
    else:
        console.print(
            f"The log is NOT what was recorded. Its chain vouches for the first {found.chained} "
            "messages; `fras log recover` saves what is left."
        )


def _verify_trial(path: Path, asp_dir: Path | None, console: Console) -> bool:
    """Hold what was done against the specifications; True if all were kept in a whole trial."""
    with require_extra("planner"):
        offline = importlib.import_module("fras_planner.offline")
    trial = read_trial(path)
    history = executed_history(trial)
    attached = rules_in(read_attachments(path), path) if asp_dir is None else {}
    judged = offline.verify_history(history, asp_dir, attached, str(path))
    console.print(escape(_whose(judged, asp_dir, trial, attached=bool(attached))), soft_wrap=True)
    broken: list[str] = list(judged.broken)
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
    return is_whole and list(said or []) == broken == []


def _whose(judged: Any, asp_dir: Path | None, trial: Trial, *, attached: bool) -> str:
    """Say by whose specifications was judged: one may promise less than another."""
    digest = judged.asp_digest[:12]
    if asp_dir is not None:
        return f"Specifications: those in {asp_dir} (rules {digest})."
    if attached:
        same = (
            "the same as this machine's"
            if judged.ours
            else f"NOT this machine's (rules {judged.our_digest[:12]}): --asp-dir takes others"
        )
        return f"Specifications: those attached to the log (rules {digest}), {same}."
    others = sorted({plan.asp_digest[:12] for plan in trial.plans} - {digest})
    planned = f"; it was planned by other rules ({', '.join(others)})" if others else ""
    return f"Specifications: this machine's (rules {digest}), for the log attaches none{planned}."


def executed_history(trial: Trial) -> dict[int, list[str]]:
    """Return for each action carried out what was sensed and asked for before it, and the action.

    The planner tells of each by which context and plan it was done. Where it does not, action
    ``gK`` follows on context ``cK``: it asks for one before each, and numbers both alike.
    """
    done = {one.goal: one for status in trial.statuses for one in status.done}
    contexts = {context.request_id: context for context in trial.contexts}
    plans = {plan.request_id: plan for plan in trial.plans}
    history: dict[int, list[str]] = {}
    for result in trial.results:
        number = _number("g", result.goal_id)
        known = done.get(number)
        if done and known is None and result.reason == "restart":
            # Ended before it began: motion started again in that moment.
            continue
        before = contexts.get(known.context if known is not None else f"c{number}")
        plan = plans.get(known.plan) if known is not None else _plan_of(number, trial.plans)
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
