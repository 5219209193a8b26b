"""`fras log recover`: what a damaged log still holds, as a log of its own."""

import time
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from fras_cli.progress import read_progress
from fras_cli.run import EXIT_NOT_SUCCESS
from fras_log import recover_file


def recover_log(path: Path, out: Path | None, console: Console) -> int:
    """Write all that a log still holds into a new one, beside it by default.

    Returns
    -------
    int
        0 if any message came back, else 1.

    Raises
    ------
    NoSuchLog, NotAnMcap, ForeignLog, LogExists
    """
    target = out or path.with_suffix(".recovered.mcap")
    with read_progress(console, "recovering") as progress:
        recovery = recover_file(path, target, time.time_ns(), progress=progress)
    for damage in recovery.damage:
        console.print(f"was damaged: {escape(damage)}", style="yellow")
    if not recovery.damage:
        console.print("nothing was damaged")
    ticks = f", up to tick {recovery.last_tick}" if recovery.last_tick >= 0 else ""
    console.print(
        f"{recovery.messages} messages recovered{ticks}; the chain of the old log vouches for the "
        f"first {recovery.chained}"
    )
    console.print(f"written: {recovery.path}", soft_wrap=True)
    return 0 if recovery.messages else EXIT_NOT_SUCCESS
