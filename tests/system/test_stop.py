"""The stop: while others are frozen, dead or restarted, with real processes and signals."""

import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from subprocess import Popen
from typing import Any

import psutil
import pytest

from fras_cli.link import Link
from fras_cli.options import build_trial
from fras_cli.stack import Layout, UsedStack, own_stack
from fras_cli.trial import TrialFollower
from fras_common.bus import RemoteFault
from fras_common.messages import Health, HoldRequest, HoldState, ResumeRequest, RobotState
from fras_common.topics import HEALTH, HOLD, RESUME, ROBOT_STATE
from fras_supervisor import free_port

WaitUntil = Callable[[Callable[[], Any], str], Any]

ACKNOWLEDGED_S = 1.0
OTHERS = ("fras_recorder", "fras_planner", "fras_sa", "fras_sim")


class Watched:
    """A stack with a trial under way, and every robot state that it said."""

    def __init__(self, stack: UsedStack, folder: Path, wait_until: WaitUntil) -> None:
        self.link = stack.link
        self.states: list[RobotState] = []
        self._wait_until = wait_until
        self._processes = {
            module: process
            for process in psutil.Process(os.getpid()).children(recursive=True)
            for module in (*OTHERS, "fras_motion", "fras_common.router")
            if module in process.cmdline() and stack.link.cell in process.cmdline()
        }
        self._health: list[Health] = []
        self.link.bus.subscribe(ROBOT_STATE, self.states.append)
        self.link.bus.subscribe(HEALTH.of(service="motion"), self._health.append)
        follower = TrialFollower(stack)
        follower.start("stopped", build_trial("a", pace=1).scenario, folder / "trial", b"")

    def until_phase(self, phase: str) -> None:
        self._wait_until(
            lambda: (
                self.states
                and self.states[-1].action is not None
                and self.states[-1].action.phase == phase
            ),
            phase,
        )

    def signal(self, number: signal.Signals, *modules: str) -> None:
        for module in modules:
            self._processes[module].send_signal(number)

    def hold(self) -> HoldState:
        began_s = time.monotonic()
        state = self.link.bus.query(HOLD, HoldRequest(holder="surgeon", reason="stop"), 5.0)
        assert time.monotonic() - began_s < ACKNOWLEDGED_S
        return state

    def until_health(self, count: int) -> None:
        """Wait until motion has said some times more how it is."""
        wanted = len(self._health) + count
        self._wait_until(lambda: len(self._health) >= wanted, "motion says how it is")


@pytest.fixture
def watched(tmp_path: Path, wait_until: WaitUntil) -> Iterator[Watched]:
    with own_stack(f"stop-{tmp_path.name}", None, tmp_path / "logs") as stack:
        made = Watched(stack, tmp_path, wait_until)
        try:
            yield made
        finally:
            made.signal(signal.SIGCONT, *OTHERS)


@pytest.mark.parametrize("frozen", [("fras_recorder",), ("fras_planner",), OTHERS[:2]])
def test_a_frozen_listener_keeps_no_arm_from_stopping(
    watched: Watched, wait_until: WaitUntil, frozen: tuple[str, ...]
) -> None:
    watched.until_phase("lift")
    watched.signal(signal.SIGSTOP, *frozen)
    acknowledged = watched.hold()
    assert acknowledged.holds == {"surgeon": "stop"}
    wait_until(lambda: watched.states[-1].holds == {"surgeon": "stop"}, "the hold is shown")
    wait_until(
        lambda: (
            watched.states[-1].action is not None
            and watched.states[-1].action.phase in ("held", "interrupted")
        ),
        "at rest",
    )
    # At rest within two ticks; the one that was being computed when the stop came is before them.
    at_rest = watched.states[-1].tick
    assert at_rest <= acknowledged.tick + 3
    watched.until_health(2)
    assert watched.states[-1].tick == at_rest
    watched.signal(signal.SIGCONT, *frozen)


def test_a_frozen_simulator_stands_the_arms_still_and_the_stop_is_acknowledged(
    watched: Watched, wait_until: WaitUntil
) -> None:
    watched.until_phase("lift")
    watched.signal(signal.SIGSTOP, "fras_sim", "fras_sa")
    last = watched.states[-1].tick
    assert watched.hold().holds == {"surgeon": "stop"}
    wait_until(lambda: watched.states[-1].holds == {"surgeon": "stop"}, "the hold is shown")
    # One tick may have been on its way when they froze.
    assert watched.states[-1].tick <= last + 1


def test_a_stop_works_while_every_other_service_is_dead(
    watched: Watched, wait_until: WaitUntil
) -> None:
    watched.until_phase("lift")
    watched.signal(signal.SIGKILL, *OTHERS)
    wait_until(lambda: not any(p.is_running() for p in gone(watched)), "all are dead")
    assert watched.hold().holds == {"surgeon": "stop"}
    wait_until(lambda: watched.states[-1].holds == {"surgeon": "stop"}, "the hold is shown")


def gone(watched: Watched) -> list[psutil.Process]:
    return [
        process
        for process in psutil.Process(os.getpid()).children(recursive=True)
        if process.status() != psutil.STATUS_ZOMBIE
        and any(module in process.cmdline() for module in OTHERS)
        and watched.link.cell in process.cmdline()
    ]


TABLE = """
[process.router]
command = ["{python}", "-m", "fras_common.router", "--listen", "{connect}"]
readiness = "listening"

[process.recorder]
command = ["{python}", "-m", "fras_recorder", "--cell", "{cell}", "--connect", "{connect}"]
needs = ["router"]
readiness = "alive"
"""


class Motions:
    """Starts motion by hand, beside a router and a recorder."""

    def __init__(self, link: Link, wait_until: WaitUntil) -> None:
        self.link = link
        self._wait_until = wait_until
        self.process: Popen[bytes] | None = None

    def start(self) -> None:
        self.process = Popen(
            [
                *(sys.executable, "-m", "fras_motion"),
                *("--cell", self.link.cell, "--connect", self.link.connect),
            ]
        )
        self._wait_until(lambda: "alive/motion" in self.link.tokens(), "motion is there")

    def kill(self) -> None:
        assert self.process is not None
        self.process.kill()
        self.process.wait()
        self._wait_until(lambda: "alive/motion" not in self.link.tokens(), "motion is gone")


@pytest.fixture
def motions(tmp_path: Path, wait_until: WaitUntil) -> Iterator[Motions]:
    table = tmp_path / "table.toml"
    table.write_text(TABLE)
    connect = f"tcp/127.0.0.1:{free_port()}"
    with own_stack(
        f"restart-{tmp_path.name}", connect, tmp_path / "logs", layout=Layout(str(table))
    ) as stack:
        made = Motions(stack.link, wait_until)
        try:
            yield made
        finally:
            if made.process is not None:
                made.process.kill()
                made.process.wait()


def test_a_motion_that_was_killed_comes_back_with_its_holds(
    motions: Motions, wait_until: WaitUntil
) -> None:
    bus = motions.link.bus
    motions.start()
    bus.query(HOLD, HoldRequest(holder="surgeon", reason="bleeding"), 5.0)
    # Killed at the worst moment: right after it said yes.
    motions.kill()
    motions.start()

    def holds() -> dict[str, str]:
        state = bus.query(HOLD, HoldRequest(holder="probe", reason="asks"), 5.0)
        return {holder: why for holder, why in state.holds.items() if holder != "probe"}

    wait_until(lambda: holds() == {"surgeon": "bleeding"}, "the hold is back")
    with pytest.raises(RemoteFault, match="NotYourHold"):
        bus.query(RESUME, ResumeRequest(holder="surgeon", by="executive"), 5.0)
    assert "surgeon" not in bus.query(RESUME, ResumeRequest(holder="surgeon", by="cli"), 5.0).holds
    motions.kill()
    motions.start()
    wait_until(
        lambda: "probe" in bus.query(HOLD, HoldRequest(holder="again", reason="asks"), 5.0).holds,
        "what stood is back",
    )
    assert holds() == {"again": "asks"}
