"""`fras keys revoke`: new names for certificates, and routers that know them, in one go."""

import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from fras_cli import runtime
from fras_cli.keys import revoke_keys
from fras_cli.link import NAME, Link
from fras_cli.restart import POLL_S
from fras_cli.run import EXIT_OK, EXIT_STACK
from fras_cli.runtime import StackRecord
from fras_common.bus import NoAnswer
from fras_common.errors import FrasError
from fras_common.messages import ProcessReport, RestartRequest, SupervisorStatus
from fras_common.topics import SUPERVISOR_RESTART, SUPERVISOR_STATUS

ASK_TIMEOUT_S = 5.0
BACK_TIMEOUT_S = 60.0
ROUTER = "router"


def revoke(folder: Path, names: list[str], days: int, console: Console) -> int:
    """Revoke, and have the routers of this machine's stacks that use the folder start again.

    Sessions come in again by themselves, each with what its files say now. Where a router can't be
    started again the old certificates are good until it is.

    Returns
    -------
    int
        0, or 3 if a stack is to be seen to.
    """
    began_s = time.monotonic()
    here = [one for one in runtime.everywhere() if one.keys == str(folder.resolve())]
    with ExitStack() as links:
        # Before: it may be our own certificate that is revoked.
        stacks = [_Stack(one, links) for one in here]
        kept = revoke_keys(folder, names, datetime.now(UTC), days)
        console.print(
            escape(f"{folder}: new certificates of {', '.join(names)}; the old ones are in {kept}"),
            soft_wrap=True,
        )
        for stack in stacks:
            stack.restart_router()
    for stack in stacks:
        stack.await_router()
    problems = [stack.problem for stack in stacks if stack.problem]
    for problem in problems:
        console.print(escape(problem), style="bold red", soft_wrap=True)
    if here and not problems:
        took_s = time.monotonic() - began_s
        console.print(f"the routers know it, after {took_s:.1f} s: the old ones may do nothing")
    if not here:
        console.print("no stack runs here with these keys: its router reads them at its start")
    console.print(
        "on other machines: copy the files (`fras keys export`), then `fras restart` their router",
        soft_wrap=True,
    )
    return EXIT_STACK if problems else EXIT_OK


class _Stack:
    """A running stack, asked by a session that was there before."""

    def __init__(self, record: StackRecord, links: ExitStack) -> None:
        self._record = record
        self._link = links.enter_context(Link(record.cell, record.connect, ASK_TIMEOUT_S))
        self._router = ""
        self._restarts = 0
        self.problem = ""
        try:
            found = self._await(self._link, lambda router: True)
            self._router, self._restarts = found.name, found.restarts
        except FrasError as error:
            self._fail(error)

    def restart_router(self) -> None:
        """Ask for it."""
        if self.problem:
            return
        try:
            request = RestartRequest(name=self._router, by=NAME)
            # The answer comes through the router that goes: it may be lost, what was asked is not.
            with suppress(NoAnswer):
                self._link.bus.query(SUPERVISOR_RESTART, request, ASK_TIMEOUT_S)
        except FrasError as error:
            self._fail(error)

    def await_router(self) -> None:
        """Wait, with the certificate of now, until its router has started again."""
        if self.problem:
            return
        try:
            with Link(self._record.cell, self._record.connect, BACK_TIMEOUT_S) as link:
                self._await(link, lambda router: router.restarts > self._restarts)
        except FrasError as error:
            self._fail(error)

    def _await(self, link: Link, wanted: Callable[[ProcessReport], bool]) -> ProcessReport:
        """Wait until the supervisor tells of a router that is ready and wanted."""
        heard: list[SupervisorStatus] = []
        link.bus.subscribe(SUPERVISOR_STATUS, heard.append)
        deadline_s = time.monotonic() + BACK_TIMEOUT_S
        while time.monotonic() < deadline_s:
            # Of several hosts each has a supervisor; ours logs where our record says.
            for status in [one for one in heard if one.log_dir == self._record.log_dir][-1:]:
                for one in status.processes:
                    if one.name.startswith(ROUTER) and one.state == "ready" and wanted(one):
                        return one
            time.sleep(POLL_S)
        raise NoAnswer(SUPERVISOR_STATUS.key, BACK_TIMEOUT_S)

    def _fail(self, error: FrasError) -> None:
        self.problem = (
            f"cell {self._record.cell}: {error}; the old certificates are good there until its "
            "router starts again: stop this stack, and start it anew"
        )
