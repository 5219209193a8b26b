"""A cell whose processes a test starts, kills and starts again, each by hand."""

import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from subprocess import Popen

import msgspec

from fras_cli.link import Link
from fras_cli.options import build_trial
from fras_cli.stack import UsedStack
from fras_cli.trial import TrialFollower, TrialView
from fras_common.errors import FrasError
from fras_common.messages import RobotState, TaskStatus
from fras_common.topics import ROBOT_STATE
from fras_supervisor import free_port
from support.logs import messages

PATIENCE_S = 120.0
# A busy machine may take more than the usual ten seconds to start a Python process.
PEER_TIMEOUT_S = 60.0
SERVICES = ("recorder", "sim", "sa", "motion", "planner")
MESH = "11,13,2"
# Where a trial crosses its limit on this mesh, on which forces are smaller, and succeeds.
LIMIT_N = {"b": 0.2, "c": 0.15}
# So many ticks after a kill whoever was killed takes part again: one was on its way.
TICKS_ON = 2
Moment = Callable[[RobotState], bool]


def in_phase(action: str, phase: str = "") -> Moment:
    """The first tick in which an action (in a phase) shows."""
    return lambda state: (
        state.action is not None
        and state.action.name == action
        and (not phase or state.action.phase == phase)
    )


@dataclass
class Kill:
    """One process, killed with SIGKILL at a moment, and started again as soon as it is gone."""

    victim: str
    moment: Moment
    tick: int = -1
    killed_ns: int = 0
    back_ns: int = 0

    def is_over(self, state: RobotState) -> bool:
        """Whether the victim is back, and time goes on."""
        return bool(self.back_ns) and state.tick > self.tick + TICKS_ON


class Cell:
    """A router and the services of one cell.

    Parameters
    ----------
    folder : Path
        For logs.
    """

    def __init__(self, folder: Path) -> None:
        self.name = f"recovery-{folder.name}"
        self.connect = f"tcp/127.0.0.1:{free_port()}"
        self._folder = folder
        self._processes: dict[str, Popen[bytes]] = {}
        self._kills: list[Kill] = []
        self._lock = threading.Lock()
        self._count = 0
        self.start("router")
        self.link = Link(self.name, self.connect)
        for service in SERVICES:
            self.start(service)
        assert self.link.wait_complete(PATIENCE_S), self.link.missing()
        self.link.bus.subscribe(ROBOT_STATE, self._on_robot)
        self._follower = TrialFollower(UsedStack(self.link, 0, None, own=False, watch=str))

    def start(self, name: str) -> None:
        command = [sys.executable, "-m", f"fras_{name}", "--cell", self.name]
        command += ["--connect", self.connect]
        if name == "router":
            command = [sys.executable, "-m", "fras_common.router", "--listen", self.connect]
        with (self._folder / f"{name}.log").open("ab") as sink:
            self._processes[name] = Popen(command, stdout=sink, stderr=subprocess.STDOUT)

    def kill_at(self, kills: list[Kill]) -> None:
        """Kill each in the very moment in which a robot state is heard, one after the other."""
        with self._lock:
            self._kills = kills

    def _on_robot(self, state: RobotState) -> None:
        with self._lock:
            for kill in self._kills:
                if not kill.killed_ns and kill.moment(state):
                    kill.tick, kill.killed_ns = state.tick, time.time_ns()
                    self._processes[kill.victim].kill()
                if not kill.is_over(state):
                    return

    def _show(self, view: TrialView) -> None:
        """Start again what was killed, as soon as it is gone."""
        del view
        for kill in self._kills:
            gone = kill.killed_ns and self._processes[kill.victim].poll() is not None
            if gone and not kill.back_ns:
                self.start(kill.victim)
                kill.back_ns = time.time_ns()

    def run(self, scenario: str, pace: float = 0) -> tuple[TaskStatus, Path]:
        """Run a trial to its end; returns its last status and its log."""
        self._count += 1
        trial = build_trial(scenario, pace=pace, mesh=MESH)
        run = msgspec.structs.replace(trial.scenario.run, peer_timeout_s=PEER_TIMEOUT_S)
        awareness = trial.scenario.awareness
        limit_n = LIMIT_N.get(scenario, awareness.force_limit_n)
        patient = msgspec.structs.replace(
            trial.scenario,
            run=run,
            awareness=msgspec.structs.replace(awareness, force_limit_n=limit_n),
        )
        folder = self._folder / f"trial-{self._count}"
        views: list[TrialView] = []
        deadline_s = time.monotonic() + PATIENCE_S

        def look(view: TrialView) -> None:
            views[:] = [view]
            self._show(view)

        self._follower.start(f"trial-{self._count}", patient, folder, trial.mesh)
        ended = self._follower.follow(look, stop=lambda: time.monotonic() > deadline_s)
        self.kill_at([])
        status = views[-1].task
        if not ended:
            # So that the next trial of this cell is not refused for this one's sake.
            deadline_s = time.monotonic() + PATIENCE_S
            with suppress(FrasError):
                self._follower.abort("it has no end")
                self._follower.follow(look, stop=lambda: time.monotonic() > deadline_s)
        assert ended, f"no end within {PATIENCE_S} s: {status}"
        assert status is not None
        return status, folder / "audit.mcap"

    def close(self) -> None:
        self.link.close()
        for process in self._processes.values():
            process.kill()
            process.wait()


def ticks_of(log: Path, key: str) -> set[int]:
    """Ticks of which a log holds a message."""
    return {one.tick for one in messages(log, key)}
