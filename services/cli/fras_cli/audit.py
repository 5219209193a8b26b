"""`fras audit`: every decision and every state of a log derived again, and compared."""

import importlib
import time
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskID, TextColumn
from rich.table import Table

from fras_cli.run import EXIT_BAD_INPUT, EXIT_NOT_SUCCESS, EXIT_OK
from fras_common.errors import FrasError
from fras_common.extras import require_extra

# An audit that is over by then says nothing on the way.
QUIET_S = 2.0


class UnknownService(FrasError):
    """A service that can't be audited."""

    service: str


class Bar:
    """Says how far an audit is, once it takes long enough for that to matter."""

    def __init__(self, console: Console) -> None:
        self._bar = Progress(
            TextColumn("deriving {task.description}"),
            BarColumn(),
            TextColumn("{task.completed} of {task.total}"),
            console=console,
            transient=True,
        )
        self._began_s = time.monotonic()
        self._tasks: dict[str, TaskID] = {}

    def __call__(self, service: str, done: int, total: int) -> None:
        """Take note of what has been done."""
        if not self._bar.live.is_started:
            if time.monotonic() - self._began_s < QUIET_S:
                return
            self._bar.start()
        if service not in self._tasks:
            self._tasks[service] = self._bar.add_task(service, total=total)
        self._bar.update(self._tasks[service], completed=done)

    def close(self) -> None:
        """Take the bar away."""
        self._bar.stop()


@contextmanager
def _bar() -> Generator[Bar]:
    bar = Bar(Console(stderr=True))
    try:
        yield bar
    finally:
        bar.close()


def audit(path: Path, only: str | None, *, as_json: bool, console: Console) -> int:
    """Derive a log again and print what differs.

    Returns
    -------
    int
        0 if each service that was asked for was compared and all of it is equal, else 1.
    """
    with require_extra("audit"):
        fras_audit = importlib.import_module("fras_audit")
    chosen = _chosen(only, fras_audit.SERVICES)
    with require_extra("audit"), _bar() as bar:
        report = fras_audit.audit_log(path, chosen, bar)
    if as_json:
        print(msgspec.json.encode(report.plain(), enc_hook=str).decode())
    else:
        _print_report(report, console)
    return EXIT_OK if report.passed else EXIT_NOT_SUCCESS


def _chosen(only: str | None, known: Sequence[str]) -> tuple[str, ...]:
    """Return the services asked for, in the order of the audit."""
    names = {name.strip() for name in only.split(",")} if only is not None else set(known)
    for name in sorted(names - set(known)):
        raise UnknownService(
            f"--only {name}: no such service to audit; there are {', '.join(known)}", service=name
        )
    return tuple(name for name in known if name in names)


def _print_report(report: Any, console: Console) -> None:
    table = Table("service", "what", "in the log", "compared", "equal", "different")
    for tally in report.tallies:
        equal = (
            f"{tally.equal}, {tally.tolerated} within tolerance" if tally.tolerated else tally.equal
        )
        row = (tally.total, tally.compared, equal, tally.differences)
        style = None if tally.is_clean else "bold red"
        table.add_row(tally.service, tally.what, *map(str, row), style=style)
    console.print(table)
    for tally in report.tallies:
        _print_first(tally, console)
        for note in dict.fromkeys(tally.notes):
            console.print(f"{tally.service}, {tally.what}: {escape(note)}.")
        if tally.skipped:
            console.print(f"{tally.service}, {tally.what}: {tally.skipped} not derived.")
    for key, missing in sorted(report.gaps.items()):
        console.print(f"{missing} messages of {key} are missing by their numbers.")
    if report.malformed:
        console.print(f"{report.malformed} messages could not be understood: of another version?")
    if report.damage:
        console.print(f"The log is cut: {escape(report.damage)}; what it holds was audited.")
    console.print(_verdict(report))


def _print_first(tally: Any, console: Console) -> None:
    first = tally.first
    if first is None:
        return
    console.print(
        f"{tally.service}, {tally.what}: first difference in {escape(first.where)}"
        + (f", number {first.seq} on its key" if first.seq >= 0 else "")
        + (f": {escape(first.path)}" if first.path else ""),
        style="bold",
    )
    console.print(f"  recorded  {escape(str(first.recorded))}")
    console.print(f"  derived   {escape(str(first.derived))}")


def _verdict(report: Any) -> str:
    took = f"in {report.took_s:.1f} s"
    differences = sum(tally.differences for tally in report.tallies)
    if differences:
        return f"{report.compared} messages derived again {took}: {differences} differ."
    if report.passed:
        return f"{report.compared} messages derived again {took}: all equal."
    return f"{report.compared} messages derived again {took}: all equal, but not all could be."


def other_rules(path: Path, asp_dir: Path, *, as_json: bool, console: Console) -> int:
    """Print what other rules would have decided in the situations of a log.

    Returns
    -------
    int
        0: it is a question, whatever the answer; 2 if the rules can't be used.
    """
    with require_extra("audit"):
        reading = importlib.import_module("fras_audit.reading")
        decisions = importlib.import_module("fras_audit.decisions")
    recorded = reading.read_recorded(path)
    try:
        found = decisions.decide_by(recorded, asp_dir)
    except FrasError as error:
        console.print(f"fras: {error}", style="red", markup=False)
        return EXIT_BAD_INPUT
    if as_json:
        print(msgspec.json.encode(found).decode())
    else:
        _print_decisions(found, asp_dir, console)
    return EXIT_OK


def _print_decisions(found: Any, asp_dir: Path, console: Console) -> None:
    table = Table("context", "as recorded", f"by {asp_dir}", "why", show_lines=True)
    for one in found.differing:
        table.add_row(
            f"{one.request_id}, tick {one.tick}\n{escape(one.reason)}",
            escape("\n".join(one.recorded) or "nothing more to do"),
            escape("\n".join(one.other) or "nothing more to do"),
            escape("\n".join(one.other_why)),
        )
    if found.differing:
        console.print(table)
    console.print(
        f"{len(found.all)} decisions asked for again, {len(found.differing)} differ"
        + (f"; {found.skipped} without their context in the log" if found.skipped else "")
        + "."
    )
