"""The surgeon's page as a process beside a stack: started with it, ended with it."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass

from fras_cli import runtime
from fras_cli.link import Link
from fras_common.errors import FrasError
from fras_common.identity import default_keys_dir

START_TIMEOUT_S = 30.0
STOP_TIMEOUT_S = 10.0
POLL_S = 0.05
NAME = "monitor"


class NoPage(FrasError):
    """The surgeon's page could not be started."""


@dataclass(frozen=True)
class Page:
    """Where a page listens, and who may open it.

    Attributes
    ----------
    port : int
        0: any free one.
    token : str
        Empty: that of the environment, or none.
    """

    host: str = "127.0.0.1"
    port: int = 8080
    token: str = ""
    view_token: str = ""
    read_only: bool = False

    def arguments(self) -> list[str]:
        """Return what of it the service takes as arguments."""
        told = ["--host", self.host, "--port", str(self.port)]
        return [*told, "--read-only"] if self.read_only else told

    def environment(self) -> dict[str, str]:
        """Return what of it must not stand in a list of processes."""
        told = {"FRAS_MONITOR_TOKEN": self.token, "FRAS_MONITOR_VIEW_TOKEN": self.view_token}
        return {name: value for name, value in told.items() if value}


def arguments_for(cell: str, connect: str, page: Page) -> list[str]:
    """Return what the service is started with at a router's endpoint."""
    told = ["--cell", cell, "--connect", connect, *page.arguments()]
    if connect.startswith("tls/"):
        known = (one.keys for one in runtime.all_of(cell) if one.connect == connect and one.keys)
        told += ["--tls", next(known, "") or str(default_keys_dir())]
    return told


@contextmanager
def beside(cell: str, connect: str, page: Page) -> Generator[None]:
    """Run the page beside, within the block, and begin once it hears the cell.

    Raises
    ------
    NoPage
    """
    process = subprocess.Popen(
        [sys.executable, "-m", f"fras_{NAME}", *arguments_for(cell, connect, page)],
        # It ends when our end of its standard input does, even by SIGKILL.
        env={**os.environ, **page.environment(), "FRAS_PARENT": "stdin"},
        stdin=subprocess.PIPE,
        # What it says is for people; standard output may be for a program.
        stdout=sys.stderr,
        # Ctrl-C ends the trial first, in order, and the page shows it.
        start_new_session=True,
    )
    try:
        with Link(cell, connect) as link:
            _wait(lambda: f"alive/{NAME}" in link.tokens(), process)
        yield
    finally:
        process.send_signal(signal.SIGINT)
        with process:
            try:
                process.wait(STOP_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                process.kill()


@contextmanager
def view_beside(cell: str, connect: str, page: Page | None) -> Generator[None]:
    """Run the page beside if there is to be one."""
    with nullcontext() if page is None else beside(cell, connect, page):
        yield


def _wait(there: Callable[[], bool], process: subprocess.Popen[bytes]) -> None:
    deadline_s = time.monotonic() + START_TIMEOUT_S
    while not there():
        if process.poll() is not None:
            raise NoPage("the surgeon's page ended as it began: see above", status=process.poll())
        if time.monotonic() > deadline_s:
            raise NoPage(f"the surgeon's page is not there after {START_TIMEOUT_S} s", status=None)
        time.sleep(POLL_S)
