"""`fras status`: what runs in a cell, once or redrawn until interrupted."""

import time

from rich.console import Console
from rich.live import Live

from fras_cli.keep import QUERY_TIMEOUT_S, endpoint
from fras_cli.link import Link
from fras_cli.run import EXIT_OK, EXIT_STACK, caught_interrupts
from fras_cli.status_view import Heard, render
from fras_common.topics import HEALTH, SUPERVISOR_STATUS, TASK_STATUS

WAIT_S = 2.5
POLL_S = 0.05
REDRAW_S = 0.5


def status(cell: str, connect: str | None, console: Console, *, watch: bool = False) -> int:
    """Show processes, health and task of a cell; 0 if every process is ready."""
    place = endpoint(cell, connect)
    title = f"cell {cell} at {place}"
    heard = Heard()
    with Link(cell, place, open_timeout_s=QUERY_TIMEOUT_S) as link:
        link.bus.subscribe(HEALTH, heard.on_health)
        link.bus.subscribe(SUPERVISOR_STATUS, heard.on_supervisor)
        link.bus.subscribe(TASK_STATUS, heard.on_task)
        deadline_s = time.monotonic() + WAIT_S
        while not heard.is_full() and time.monotonic() < deadline_s:
            time.sleep(POLL_S)
        if watch:
            _redraw(title, heard, link, console)
        else:
            console.print(render(title, heard, link.tokens()))
        whole = all(one.verdict == "whole" for one in heard.supervisors.values())
        return EXIT_OK if whole and not link.missing() else EXIT_STACK


def _redraw(title: str, heard: Heard, link: Link, console: Console) -> None:
    """Draw in place on a terminal; elsewhere one after the other."""
    with caught_interrupts() as interrupts, Live(console=console, auto_refresh=False) as live:
        while not interrupts.count:
            drawn = render(title, heard, link.tokens())
            if console.is_terminal:
                live.update(drawn, refresh=True)
            else:
                console.print(drawn)
            time.sleep(REDRAW_S)
