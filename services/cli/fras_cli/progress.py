"""How far a command is that reads a large log."""

import time
from collections.abc import Callable, Generator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TimeRemainingColumn

from fras_log.scan import Progress as Told

PATIENCE_S = 2.0
AT_MOST_EVERY_S = 0.1


@contextmanager
def read_progress(
    console: Console, what: str, clock: Callable[[], float] = time.monotonic
) -> Generator[Told]:
    """Show a bar once reading has taken longer than people wait for.

    Parameters
    ----------
    console : Console
    what : str
        Stands before the bar.
    clock : callable
        Seconds from anywhere.
    """
    bar = Progress(
        TextColumn(what), BarColumn(), DownloadColumn(), TimeRemainingColumn(), console=console,
        transient=True,
    )  # fmt: skip
    task = bar.add_task(what, total=None)
    show_at_s = clock() + PATIENCE_S
    shown = False

    def tell(position: int, size: int) -> None:
        nonlocal shown, show_at_s
        now_s = clock()
        if now_s < show_at_s:
            return
        if not shown:
            bar.start()
            shown = True
        show_at_s = now_s + AT_MOST_EVERY_S
        bar.update(task, completed=position, total=size)

    try:
        yield tell
    finally:
        if shown:
            bar.stop()
