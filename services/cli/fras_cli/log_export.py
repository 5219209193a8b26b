"""`fras log export`: a log as files that viewers open."""

import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn
from rich.text import Text

from fras_common.errors import FrasError
from fras_log.export import Exported, Format, export
from fras_log.export.exporting import Progress as Told
from fras_log.export.layout import layout
from fras_log.export.outputs import appearing, check_outputs

QUIET_S = 2.0
LAYOUT = ".layout.json"
OPEN_WITH = {
    Format.FOXGLOVE: "open it in Foxglove or Lichtblick",
    Format.RERUN: "open it with `rerun {path}`",
}


class NoFormat(FrasError):
    """Neither format was asked for."""


def output_paths(log: Path, out: Path | None, kinds: list[Format]) -> dict[Format, Path]:
    """Name the files: beside the log, or as `out` says.

    With two formats `out` gives the name without its ending.

    Raises
    ------
    NoFormat
    """
    if not kinds:
        raise NoFormat("say what to write: --foxglove, --rerun, or both")
    if out is not None and len(kinds) == 1:
        return {kinds[0]: out}
    stem = out or log.with_suffix("")
    return {kind: stem.with_name(f"{stem.name}{kind}") for kind in kinds}


def export_log(
    log: Path,
    kinds: list[Format],
    out: Path | None,
    overwrite: bool,
    with_layout: bool,
    console: Console,
) -> int:
    """Write what was asked for and print where it is and how to open it."""
    paths = output_paths(log, out, kinds)
    foxglove = paths.get(Format.FOXGLOVE)
    plan = foxglove.with_name(foxglove.name + LAYOUT) if foxglove and with_layout else None
    if plan is not None:
        check_outputs(log, [plan], overwrite)
    with _shown(console, log) as told:
        done = export(log, paths, overwrite, told)
    if plan is not None:
        with appearing(plan) as place:
            place.write_bytes(layout())
    _print(done, plan, console)
    return 0


def _print(done: Exported, plan: Path | None, console: Console) -> None:
    for kind, path in done.outputs.items():
        size_mb = path.stat().st_size / 1e6
        how = OPEN_WITH[kind].format(path=path)
        console.print(Text(f"{path}: {size_mb:.1f} MB, {how}"), soft_wrap=True)
    if plan is not None:
        console.print(Text(f"{plan}: a layout for it, import it there"), soft_wrap=True)
    if done.malformed:
        console.print(f"{done.malformed} messages could not be understood and are left out")
    if done.damage:
        until = f"up to tick {done.last_tick}" if done.last_tick >= 0 else "before the first tick"
        text = f"the log is cut off: exported is what it holds, {until} ({done.damage})"
        console.print(Text(text, style="yellow"), soft_wrap=True)


@contextmanager
def _shown(console: Console, log: Path) -> Generator[Told]:
    """Show how far it is, once it has taken longer than one likes to wait in the dark."""
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
    bar = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
    task = bar.add_task(f"exporting {log.name}", total=1.0)
    begun_s, told_at_s = time.monotonic(), QUIET_S

    def told(share: float) -> None:
        nonlocal told_at_s
        passed_s = time.monotonic() - begun_s
        if passed_s < told_at_s:
            return
        if console.is_terminal:
            bar.start()
            bar.update(task, completed=share)
            told_at_s = passed_s + 0.1
        else:
            console.print(f"exporting {log.name}: {share:.0%}", highlight=False)
            told_at_s = passed_s + 5.0

    try:
        yield told
    finally:
        bar.stop()
