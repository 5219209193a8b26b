"""`fras plan`: plan from contexts in a file, without any service running."""

import importlib
import sys
from pathlib import Path
from typing import Any

import msgspec
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from fras_cli.run import EXIT_BAD_INPUT
from fras_common.errors import FrasError
from fras_common.extras import require_extra
from fras_common.files import CONTEXTS_BYTES, read_at_most

Row = dict[str, Any]


def plan(
    path: Path,
    *,
    criterion: str,
    goal: str,
    asp_dir: Path | None,
    questions: list[str],
    as_json: bool,
    console: Console,
) -> int:
    """Plan each context of a file and print the plans.

    Returns
    -------
    int
        0; 2 if a context, the rules or an option was refused.
    """
    with require_extra("planner"):
        offline = importlib.import_module("fras_planner.offline")
    rows: list[Row]
    try:
        text = _read(path)
        rows, is_list = offline.plan_file(
            text,
            str(path),
            criterion=criterion,
            goal=goal,
            asp_dir=asp_dir,
            questions=questions,
        )
    except FrasError as error:
        # Whatever the planner refuses, it is what it was given that is at fault.
        print(f"fras: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    if as_json:
        print(msgspec.json.encode(rows if is_list else rows[0]).decode())
    else:
        for number, row in enumerate(rows, start=1):
            if is_list:
                console.rule(f"context {number}")
            _print_row(row, console)
    return EXIT_BAD_INPUT if any("error" in row for row in rows) else 0


def _read(path: Path) -> bytes:
    if str(path) != "-":
        return read_at_most(path, CONTEXTS_BYTES)
    return sys.stdin.buffer.read(CONTEXTS_BYTES)


def _print_row(row: Row, console: Console) -> None:
    if "error" in row:
        console.print(f"Refused: {escape(row['error']['text'])}")
        return
    for sentence in row["explanation"]:
        console.print(escape(sentence))
    if row["no_plan"] is None:
        console.print(_timetable(row))
        best = "" if row["optimal"] else ", the best before the budget was spent"
        console.print(
            f"cost {row['cost']}, plans looked at: {row['models']}{best}; grounded in "
            f"{1e3 * row['ground_s']:.1f} ms, solved in {1e3 * row['solve_s']:.1f} ms"
        )
    for answer in row["why_not"]:
        console.print(f"Why not {escape(answer['question'])}?", style="bold")
        for sentence in answer["sentences"]:
            console.print(f"  {escape(sentence)}")


def _timetable(row: Row) -> Table:
    """Each action, and which atoms begin and cease to hold through it."""
    table = Table("step", "action", "begins to hold", "ceases to hold", title="Timetable")
    holds = {
        int(t): {atom for atom in atoms if not _lasts(atom)} for t, atoms in row["history"].items()
    }
    table.add_row("", "at the start", *_changes(set(), holds[1] - {_at(row, 1)}))
    for t in range(1, len(holds)):
        before, after = holds[t] - {_at(row, t)}, holds[t + 1] - {_at(row, t + 1)}
        table.add_row(str(t), _at(row, t), *_changes(before, after))
    return table


def _at(row: Row, step: int) -> str:
    return next((action["text"] for action in row["actions"] if action["t"] == step), "")


def _changes(before: set[str], after: set[str]) -> tuple[str, str]:
    return "\n".join(sorted(after - before)), "\n".join(sorted(before - after))


def _lasts(atom: str) -> bool:
    """Whether an atom is one of the scene, the same at each step."""
    return atom.startswith(("reachable(", "fixed(", "above_roi("))
