"""`fras monitor`: the surgeon's page of a stack that runs, or over a log."""

import importlib
import os
from pathlib import Path

from rich.console import Console

from fras_cli import runtime
from fras_cli.replay import Wanted, replay
from fras_cli.viewing import NAME, Page, arguments_for, beside
from fras_common.extras import require_extra


def page_of_stack(cell: str, connect: str | None, page: Page) -> int:
    """Serve the page of the stack in a cell until told to stop; returns the exit status.

    Raises
    ------
    NoStack, SeveralStacks, MissingExtra
    """
    place = connect or runtime.require_one(cell).connect
    os.environ.update(page.environment())
    with require_extra(NAME):
        main = importlib.import_module("fras_monitor.__main__").main
    return main(arguments_for(cell, place, page))


def page_of_log(log: Path, cell: str, page: Page, console: Console) -> int:
    """Play a log into a cell of its own, with the page over it; returns the exit status.

    Raises
    ------
    NoPage
    FrasError
        See `fras_cli.replay.replay`.
    """
    wanted = Wanted(cell, stay=True)
    return replay(log, wanted, console, beside=lambda connect: beside(cell, connect, page))
