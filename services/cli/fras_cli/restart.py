"""`fras restart`: a process of a running stack ends in order and starts again."""

import time

from rich.console import Console

from fras_cli.keep import HOLDER, QUERY_TIMEOUT_S, endpoint
from fras_cli.link import Link
from fras_cli.run import EXIT_OK, EXIT_STACK
from fras_common.bus import NoAnswer
from fras_common.messages import ProcessReport, RestartReply, RestartRequest, SupervisorStatus
from fras_common.topics import SUPERVISOR_RESTART, SUPERVISOR_STATUS

BACK_TIMEOUT_S = 120.0
POLL_S = 0.05
ROUTER = "router"


def restart(name: str, cell: str, connect: str | None, console: Console) -> int:
    """Ask the supervisor, and wait until the process is ready again."""
    heard: list[SupervisorStatus] = []
    with Link(cell, endpoint(cell, connect), open_timeout_s=QUERY_TIMEOUT_S) as link:
        link.bus.subscribe(SUPERVISOR_STATUS, heard.append)
        began_s = time.monotonic()
        before = _ask(link, heard, name)
        console.print(f"{name} was {before.state}; it is started again")
        while time.monotonic() - began_s < BACK_TIMEOUT_S:
            now = _report(heard, name)
            if now is not None and now.restarts > before.restarts:
                took_s = time.monotonic() - began_s
                if now.state == "ready":
                    console.print(f"{name} is ready again after {took_s:.1f} s, pid {now.pid}")
                    return EXIT_OK
                if now.state in ("given_up", "ended"):
                    console.print(f"{name} ended {now.last_exit}", style="bold red")
                    return EXIT_STACK
            time.sleep(POLL_S)
    console.print(f"{name} is not ready after {BACK_TIMEOUT_S:.0f} s: `fras logs {name}`")
    return EXIT_STACK


def _ask(link: Link, heard: list[SupervisorStatus], name: str) -> RestartReply | ProcessReport:
    """Ask; returns where the process stood then."""
    request = RestartRequest(name=name, by=HOLDER)
    told = _report(heard, name)
    try:
        return link.bus.query(SUPERVISOR_RESTART, request, QUERY_TIMEOUT_S)
    except NoAnswer:
        # A router's takes the answer along; that it starts again will be told.
        if told is None or not name.startswith(ROUTER):
            raise
        return told


def _report(heard: list[SupervisorStatus], name: str) -> ProcessReport | None:
    newest_first = (one for status in reversed(heard) for one in status.processes)
    return next((one for one in newest_first if one.name == name), None)
