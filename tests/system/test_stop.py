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

from fras_cli.layout import Layout
from fras_cli.link import Link
from fras_cli.options import build_trial
from fras_cli.stack import UsedStack, own_stack
from fras_cli.trial import TrialFollower
from fras_common.bus import RemoteFault
from fras_common.messages import (
    Health,
    HoldRequest,
    HoldState,
    LastRequest,
    ResumeRequest,
    RobotState,
)
from fras_common.topics import HEALTH, HOLD, HOLDS, RECORDER_LAST, RESUME, ROBOT_STATE
from fras_supervisor import free_port
from support.tables import table_with

WaitUntil = Callable[[Callable[[], Any], str], Any]

ACKNOWLEDGED_S = 1.0
MESH = "11,13,2"
OTHERS = ("fras_recorder", "fras_planner", "fras_sa", "fras_sim")


class Watched:
    """A stack, the trial under way on it, and every robot state of that."""

    def __init__(self, stack: UsedStack, folder: Path, wait_until: WaitUntil) -> None:
        self.link = stack.link
        self._wait_until = wait_until
        self.states: list[RobotState] = []
        self._folder = folder
        self._follower = TrialFollower(stack)
        self._trial = ""
        self._count = 0
        self._processes = {
            module: process
            for process in psutil.Process(os.getpid()).children(recursive=True)
            for module in (*OTHERS, "fras_motion", "fras_common.router")
            if module in process.cmdline() and stack.link.cell in process.cmdline()
        }
        self._health: list[Health] = []
        self.link.bus.subscribe(ROBOT_STATE, self._on_robot)
        self.link.bus.subscribe(HEALTH.of(service="motion"), self._health.append)

    def start(self) -> None:
        """Begin a trial, and see its first lift begin."""
        self._count += 1
        self._trial, self.states = f"stopped-{self._count}", []
        trial = build_trial("a", pace=1, mesh=MESH)
        self._follower.start(self._trial, trial.scenario, self._folder / self._trial, b"")
        self.until_phase("lift")

    def abort(self) -> None:
        """End the trial."""
        self._follower.abort("seen enough")
        assert self._follower.follow(lambda view: None, stop=lambda: False)

    def until_phase(self, *phases: str) -> None:
        """Wait until the action under way is in one of some phases."""

        def reached() -> bool:
            action = self.states[-1].action if self.states else None
            return action is not None and action.phase in phases

        self._wait_until(reached, " or ".join(phases))

    def until_held(self) -> None:
        """Wait until a state shows that the arms are stopped."""
        self._wait_until(
            lambda: self.states[-1].holds.get("surgeon") == "stop", "the hold is shown"
        )

    def signal(self, number: signal.Signals, *modules: str) -> None:
        """Send a signal to processes of the stack."""
        for module in modules:
            self._processes[module].send_signal(number)

    def living(self, *modules: str) -> list[str]:
        """Those that have not ended."""
        return [one for one in modules if self._processes[one].is_running()]

    def hold(self) -> HoldState:
        """Stop the arms; this is acknowledged at once, whoever is frozen or dead."""
        began_s = time.monotonic()
        state = self.link.bus.query(HOLD, HoldRequest(holder="surgeon", reason="stop"), 5.0)
        assert time.monotonic() - began_s < ACKNOWLEDGED_S
        return state

    def resume(self) -> None:
        """Let the arms go on; waits until they lift again."""
        self.link.bus.query(RESUME, ResumeRequest(holder="surgeon", by="cli"), 5.0)
        self._wait_until(lambda: self.states[-1].holds == {}, "nobody holds the arms")
        self.until_phase("lift")

    def until_health(self, count: int) -> None:
        """Wait until motion has said some times more how it is."""
        wanted = len(self._health) + count
        self._wait_until(lambda: len(self._health) >= wanted, "motion says how it is")

    def _on_robot(self, state: RobotState) -> None:
        if state.trial == self._trial:
            self.states.append(state)


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory, wait_until: WaitUntil) -> Iterator[Watched]:
    folder = tmp_path_factory.mktemp("stop")
    # Who is frozen or dead stays so for as long as the test looks.
    stays = {"watchdog_s": 0.0, "backoff_s": 60.0, "backoff_cap_s": 60.0}
    others = {module.removeprefix("fras_"): stays for module in OTHERS}
    layout = Layout(table_with(folder, **others))
    with own_stack(f"stop-{folder.name}", None, folder / "logs", layout=layout) as used:
        made = Watched(used, folder, wait_until)
        try:
            yield made
        finally:
            made.signal(signal.SIGCONT, *made.living(*OTHERS))


@pytest.fixture
def lifting(stack: Watched) -> Iterator[Watched]:
    """A lift is under way; afterwards nobody is frozen, and the trial has ended."""
    stack.start()
    yield stack
    stack.signal(signal.SIGCONT, *OTHERS)
    stack.abort()
    # Lifted only where it stands, and a test may have lifted it.
    stack.hold()
    stack.link.bus.query(RESUME, ResumeRequest(holder="surgeon", by="cli"), 5.0)


def test_a_frozen_listener_keeps_no_arm_from_stopping(lifting: Watched) -> None:
    for frozen in (("fras_recorder",), ("fras_planner",), OTHERS[:2]):
        lifting.signal(signal.SIGSTOP, *frozen)
        acknowledged = lifting.hold()
        assert acknowledged.holds == {"surgeon": "stop"}
        lifting.until_held()
        assert lifting.states[-1].holds == {"surgeon": "stop"}
        lifting.until_phase("held", "interrupted")
        # At rest within two ticks; the one that was being computed when the stop came is before
        # them.
        at_rest = lifting.states[-1].tick
        assert at_rest <= acknowledged.tick + 3
        lifting.until_health(2)
        assert lifting.states[-1].tick == at_rest
        lifting.signal(signal.SIGCONT, *frozen)
        lifting.resume()


def test_a_frozen_simulator_stands_the_arms_still_and_the_stop_is_acknowledged(
    lifting: Watched,
) -> None:
    lifting.signal(signal.SIGSTOP, "fras_sim", "fras_sa")
    acknowledged = lifting.hold()
    assert acknowledged.holds == {"surgeon": "stop"}
    lifting.until_held()
    assert lifting.states[-1].holds == {"surgeon": "stop"}
    # One tick may have been on its way when they froze.
    assert lifting.states[-1].tick <= acknowledged.tick + 1


def test_a_stop_works_while_every_other_service_is_dead(
    stack: Watched, wait_until: WaitUntil
) -> None:
    """The last one on this stack: nobody is started again."""
    stack.start()
    stack.signal(signal.SIGKILL, *OTHERS)
    wait_until(lambda: not stack.living(*OTHERS), "all are dead")
    # The dead recorder holds them, too.
    assert stack.hold().holds["surgeon"] == "stop"
    stack.until_held()


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
    # Until it has recalled who held the arms, it tells the recorder of no hold.
    asked = LastRequest(key=HOLDS.key)
    wait_until(lambda: bus.query(RECORDER_LAST, asked, 5.0).payload, "motion says what it holds")
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
