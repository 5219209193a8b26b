"""The surgeon's page beside real commands: it opens, is quiet, and ends when they do."""

import json
import os
import re
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import psutil
import pytest
from websockets.sync.client import ClientConnection, connect

from fras_cli.keys import init_keys
from fras_cli.report import Summary

Wait = Callable[[Callable[[], Any], str], Any]
ADDRESS = re.compile(r"the surgeon's page: (http://127\.0\.0\.1:\d+/)\S*")
PATIENCE_S = 60.0
EXIT_START = 3


class Program:
    """A command under way whose standard output is for a program, in its own runtime folder."""

    def __init__(self, folder: Path, *command: str) -> None:
        self._output, self._told = folder / "stdout.txt", folder / "stderr.txt"
        with self._output.open("wb") as output, self._told.open("wb") as told:
            self.process = subprocess.Popen(
                [sys.executable, "-m", *command],
                cwd=folder,
                env={**os.environ, "XDG_RUNTIME_DIR": str(folder), "COLUMNS": "200"},
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=told,
                start_new_session=True,
            )

    @property
    def output(self) -> str:
        return self._output.read_text()

    @property
    def told(self) -> str:
        return self._told.read_text()

    def address(self, wait_until: Wait) -> str:
        """Wait until it says where the page is."""

        def said() -> str:
            found = ADDRESS.search(self.told + self.output)
            assert found or self.process.poll() is None, self.told + self.output
            return found[1] if found else ""

        return wait_until(said, "where the page is")

    def page(self) -> psutil.Process:
        """Find the page's process among those that it started."""
        return next(
            one
            for one in psutil.Process(self.process.pid).children(recursive=True)
            if "fras_monitor" in one.cmdline()
        )

    def end(self) -> int:
        return self.process.wait(PATIENCE_S)


@pytest.fixture
def program(tmp_path: Path) -> Iterator[Callable[..., Program]]:
    """Start commands; what a test leaves behind is killed."""
    started: list[Program] = []

    def start(*command: str) -> Program:
        folder = tmp_path / str(len(started))
        folder.mkdir()
        started.append(Program(folder, *command))
        return started[-1]

    yield start
    for one in started:
        if one.process.poll() is None:
            one.process.kill()
            one.process.wait()


class Looker:
    """Who has the page open without drawing it: what stands there now."""

    def __init__(self, address: str) -> None:
        self._connection: ClientConnection = connect(
            f"ws://{urlsplit(address).netloc}/control", compression=None
        )
        self.view: dict[str, Any] = {}

    def send(self, **command: Any) -> None:
        self._connection.send(json.dumps(command))

    def until(self, condition: Callable[[dict[str, Any]], Any]) -> Any:
        """Read until the page shows something."""
        while not (found := condition(self.view)):
            self.view |= json.loads(self._connection.recv(timeout=PATIENCE_S))
        return found

    def close(self) -> None:
        self._connection.close()


def is_over(process: psutil.Process) -> bool:
    return not process.is_running() or process.status() == psutil.STATUS_ZOMBIE


def title_of(address: str) -> str:
    with urllib.request.urlopen(address, timeout=PATIENCE_S) as answer:
        assert answer.status == 200
        return answer.read().decode().partition("<title>")[2].partition("</title>")[0]


def test_a_trial_with_its_page_shows_itself_and_ends_both_with_its_own_status(
    program: Callable[..., Program], wait_until: Wait
) -> None:
    run = program(
        *("fras_cli", "run", "a", "--mesh", "11,13,2", "--json", "--out", "out"),
        *("--view", "--view-port", "0"),
    )
    address = run.address(wait_until)
    assert title_of(address) == "FRAS: surgeon's page"
    looker = Looker(address)
    looker.until(lambda view: view.get("live"))
    looker.until(lambda view: "lifting the tissue" in view["headline"])
    page = run.page()
    assert run.end() == 0
    assert is_over(page)
    looker.close()
    # Of the page, and of viser, nothing: what reads this expects a summary alone.
    (line,) = run.output.splitlines()
    assert set(json.loads(line)) == set(Summary.__struct_fields__) - {"patient", "detail"}
    assert "viser" not in run.told


def test_the_page_ends_with_a_killed_command_but_not_with_a_router_that_starts_again(
    program: Callable[..., Program], wait_until: Wait
) -> None:
    run = program(
        *("fras_cli", "run", "a", "--mesh", "11,13,2", "--pace", "0.05", "--out", "out"),
        *("--view", "--view-port", "0"),
    )
    address = run.address(wait_until)
    looker = Looker(address)
    looker.until(lambda view: view.get("live") and "reaching" in view["headline"])
    page = run.page()
    router = next(
        one
        for one in psutil.Process(run.process.pid).children(recursive=True)
        if "fras_common.router" in one.cmdline()
    )
    router.kill()
    looker.until(lambda view: not view["live"])
    looker.until(lambda view: view["live"])
    assert not is_over(page)
    looker.close()
    run.process.kill()
    run.end()
    wait_until(lambda: is_over(page), "the page has ended by itself")


def test_the_page_of_a_log_has_a_time_line_that_plays_and_jumps(
    program: Callable[..., Program], wait_until: Wait, trials: Any
) -> None:
    _, log = trials.run("b", mesh="11,13,2")
    monitor = program("fras_cli", "monitor", str(log), "--cell", "page-log", "--port", "0")
    looker = Looker(monitor.address(wait_until))
    line = looker.until(lambda view: (one := view.get("replay")) and one["marks"] and one)
    assert "Replay" in looker.view["live_words"]
    looker.send(do="replay", command="pause")
    looker.until(lambda view: view["replay"]["phase"] == "paused")
    crossing = next(at for at, kind, _ in line["marks"] if kind == "crossing")
    looker.send(do="replay", command="seek_s", value=crossing)
    looker.until(lambda view: abs(view["replay"]["position_s"] - crossing) < 0.01)
    looker.until(lambda view: "0.5" in view["force"]["words"])
    looker.send(do="replay", command="seek_s", value=line["begin_s"])
    looker.until(lambda view: view["replay"]["position_s"] < crossing)
    # As it is paused it stands at the next event, to the digits that are told.
    first = next(at for at, _, _ in line["marks"] if at > line["begin_s"] + 0.01)
    looker.send(do="replay", command="next_mark")
    looker.until(lambda view: abs(view["replay"]["position_s"] - first) < 0.01)
    looker.send(do="replay", command="play")
    looker.until(lambda view: view["replay"]["phase"] == "playing")
    looker.until(lambda view: view["replay"]["position_s"] > first + 0.1)
    page = monitor.page()
    looker.close()
    monitor.process.send_signal(signal.SIGINT)
    assert monitor.end() == 0
    assert is_over(page)
    assert "viser" not in monitor.output + monitor.told


def test_a_page_with_a_certificate_is_let_in_and_one_of_another_authority_is_not(
    program: Callable[..., Program], wait_until: Wait, secure_trials: Any, tmp_path: Path
) -> None:
    link = secure_trials.stack.link
    place = ("--cell", link.cell, "--connect", link.connect, "--port", "0")
    ours, foreign = secure_trials.stack.log_dir.parent / "keys", tmp_path / "foreign"
    let_in = program("fras_monitor", *place, "--tls", str(ours))
    looker = Looker(let_in.address(wait_until))
    looker.until(lambda view: view.get("live"))
    looker.close()
    assert let_in.output.count("\n") == 1
    init_keys(foreign, datetime.now(UTC))
    left_out = program("fras_monitor", *place, "--tls", str(foreign))
    assert left_out.end() == EXIT_START
    assert left_out.output == ""
    assert "certificate" in left_out.told
    # A page that shows none does not get in, either.
    assert program("fras_monitor", *place).end() == EXIT_START
