"""A real stack whose processes are killed, frozen and given up: who is back, who is held."""

import json
import re
import signal
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

import psutil

from fras_common.topics import SERVICES
from fras_supervisor import free_port
from fras_supervisor.probe import main as probe
from support.tables import table_with

Fras = Callable[..., Any]
RESTARTED_WITHIN_S = 2.0


class Up:
    """A stack of `fras up`, and commands to it."""

    def __init__(self, fras: Fras, folder: Path, *options: str) -> None:
        self._fras = fras
        port = free_port()
        self.connect = f"tcp/127.0.0.1:{port}"
        self.command = fras("up", "--cell", "up", "--port", str(port), *options)
        self.command.until("ready after")
        self.log = folder / "runs" / "up-up" / "logs" / "supervisor.log"

    def process(self, module: str) -> psutil.Process:
        """Find the one that runs `python -m module`."""
        (one,) = (
            child
            for child in self.command.note_family()
            if child.status() != psutil.STATUS_ZOMBIE and module in child.cmdline()
        )
        return one

    def fras(self, *arguments: str, status: int = 0) -> str:
        """Run a command on the stack to its end; returns what it printed."""
        command = self._fras(arguments[0], "--cell", "up", *arguments[1:])
        assert command.end() == status, command.text
        return command.text

    def told(self, name: str, event: str) -> list[dict[str, Any]]:
        """What the supervisor's log has of a process."""
        lines = [json.loads(line) for line in self.log.read_text().splitlines()]
        return [one for one in lines if one.get("process") == name and event in one["event"]]


def seconds_of(stamp: str) -> float:
    return datetime.fromisoformat(stamp).timestamp()


def test_what_is_killed_or_frozen_comes_back_until_it_is_given_up(
    fras: Fras, tmp_path: Path, wait_until: Callable[..., Any]
) -> None:
    """A trial runs after it all; who is then killed over its budget has the arms held."""
    sim = {"restart_budget": 1, "restart_window_s": 600.0}
    table = table_with(tmp_path, sa={"watchdog_s": 2.0}, sim=sim)
    stack = Up(fras, tmp_path, "--compose", table)
    planner, motion = stack.process("fras_planner").pid, stack.process("fras_motion").pid
    # One is killed, another frozen.
    stack.process("fras_sim").kill()
    stack.process("fras_sa").send_signal(signal.SIGSTOP)
    wait_until(lambda: stack.told("sim", "ready"), "sim is back")
    (end,) = stack.told("sim", "ended by signal 9")
    assert end["level"] == "warning"
    started = re.findall(r"\[supervisor\] (\S+)", (stack.log.parent / "sim.log").read_text())
    assert seconds_of(started[1]) - seconds_of(end["timestamp"]) < RESTARTED_WITHIN_S
    wait_until(lambda: stack.told("sa", "ready"), "sa is back")
    assert "no sign of life for 2" in stack.told("sa", "killed")[0]["event"]
    # The router: the others find it again by themselves.
    stack.process("fras_common.router").kill()
    wait_until(lambda: stack.told("router", "ready"), "the router is back")
    assert stack.process("fras_planner").pid == planner
    assert stack.process("fras_motion").pid == motion
    # As a container's health check would see it.
    asked = ["--cell", "up", "--connect", stack.connect]
    for name in SERVICES:
        wait_until(lambda name=name: probe([f"ready/{name}", *asked]) == 0, f"{name} is seen again")
    assert probe(["ready/sun", *asked]) == 1
    # One is told to, and somebody looks on.
    follower = fras("logs", "--cell", "up", "--follow", "-n", "0", "planner", "sim")
    watcher = fras("status", "--cell", "up", "--watch")
    watcher.until("planner  ready")
    assert "planner is ready again" in stack.fras("restart", "planner")
    assert stack.process("fras_planner").pid != planner
    follower.until("planner | [supervisor]")
    watcher.until("planner last ended with exit status 0")
    for one in (follower, watcher):
        one.process.send_signal(signal.SIGINT)
        assert one.end() == 0
    assert "sim     |" not in follower.text
    stack.fras("run", "a", "--pace", "0", "--mesh", "11,13,2", "--out", "out")
    assert "no process 'nobody'" in stack.fras("restart", "nobody", status=1)
    # Once more than it may.
    stack.process("fras_sim").kill()
    stack.command.until("supervisor: motion holds the arms")
    stack.command.until("the rest runs on: `fras restart NAME`")
    status = stack.fras("status", status=3)
    assert "safe hold: sim was given up" in status
    assert "motion holds the arms" in status
    assert "the arms are stopped by supervisor" in status
    # Somebody mends it, and lets the arms go on.
    assert "sim is ready again" in stack.fras("restart", "sim")
    assert "no hold is in force" in stack.fras("resume", "--holder", "supervisor")
    # A supervisor that is killed takes along those of a later life, too.
    stack.command.note_family()
    stack.command.process.kill()
    stack.command.end()
    wait_until(stack.command.alone, "nothing is left")
