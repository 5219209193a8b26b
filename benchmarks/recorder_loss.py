"""What of a trial's traffic arrives in the log, through a real router and a real recorder."""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import msgspec
from benchmarks.recorder_samples import SHAPES, TRIAL, robot, tissue, verdict

from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.messages import CloseRequest, OpenRequest, TaskStatus
from fras_common.scenario import Scenario
from fras_common.topics import (
    RECORDER_CLOSE,
    RECORDER_OPEN,
    ROBOT_STATE,
    TASK_STATUS,
    TISSUE_STATE,
    VERDICT,
)
from fras_log.scan import Recorded, scan
from fras_supervisor import free_port

WAIT_S = 20.0
TICKS_S = 50
"""Of a trial at pace 1."""
PER_TICK = 3
PRODUCERS = ("motion", "sa", "sim", "planner")


@contextmanager
def processes(connect: str) -> Generator[subprocess.Popen[bytes]]:
    """A router and a recorder; yields the latter."""
    environment = os.environ | {"FRAS_PARENT": "stdin"}
    router = [sys.executable, "-m", "fras_common.router", "--listen", connect]
    recorder = [sys.executable, "-m", "fras_recorder", "--connect", connect, "--cell", "bench"]
    with (
        subprocess.Popen(router, stdin=subprocess.PIPE, env=environment) as one,
        subprocess.Popen(recorder, stdin=subprocess.PIPE, env=environment) as other,
    ):
        try:
            yield other
        finally:
            for process in (other, one):
                process.terminate()
                process.wait(WAIT_S)


def measure(folder: Path, speeds: list[float], seconds: float) -> list[dict[str, Any]]:
    """Send a trial's three keys at each multiple of its rate, and look into the log."""
    connect = f"tcp/127.0.0.1:{free_port()}"
    with processes(connect) as recorder, ExitStack() as opened:
        buses: dict[str, ZenohBus] = {}
        for name in ("cli", *PRODUCERS):
            buses[name] = ZenohBus("bench", connect, f"{name}/1", open_timeout_s=WAIT_S)
            opened.callback(buses[name].close)
        _await_recorder(buses["cli"])
        return [_one(buses, folder, recorder.pid, speed, seconds) for speed in speeds]


def _await_recorder(bus: ZenohBus) -> None:
    ready = threading.Event()
    bus.watch_tokens(lambda token, here: ready.set() if here and "recorder" in token else None)
    if not ready.wait(WAIT_S):
        raise RuntimeError("the recorder did not start")


def _one(
    buses: dict[str, ZenohBus], folder: Path, pid: int, speed: float, seconds: float
) -> dict[str, Any]:
    bus = buses["cli"]
    directory = folder / f"{speed:g}"
    scenario = Scenario(seed=1)
    request = OpenRequest(trial=TRIAL, scenario=scenario, mesh=b"", directory=str(directory))
    bus.query(RECORDER_OPEN, request, WAIT_S)
    robots = buses["motion"].publisher(ROBOT_STATE)
    verdicts = buses["sa"].publisher(VERDICT)
    tissues = buses["sim"].publisher(TISSUE_STATE)
    shapes = [tissue(tick) for tick in range(SHAPES)]
    ticks = round(TICKS_S * speed * seconds)
    pause = threading.Event()
    cpu_s, began_s = _cpu_s(pid), time.perf_counter()
    for tick in range(ticks):
        ahead_s = began_s + tick / (TICKS_S * speed) - time.perf_counter()
        if ahead_s > 0:
            pause.wait(ahead_s)
        robots.put(robot(tick))
        tissues.put(msgspec.structs.replace(shapes[tick % SHAPES], tick=tick))
        verdicts.put(verdict(tick))
    spent_s = time.perf_counter() - began_s
    status = buses["planner"].publisher(TASK_STATUS).put(_ended())
    close = CloseRequest(trial=TRIAL, last_tick=ticks - 1, status_seq=status.seq)
    reply = bus.query(RECORDER_CLOSE, close, WAIT_S)
    used_s = _cpu_s(pid) - cpu_s
    log = Path(reply.path)
    names = {ROBOT_STATE.key, TISSUE_STATE.key, VERDICT.key}
    arrived = sum(isinstance(one, Recorded) and one.topic in names for one in scan(log))
    return {
        "speed": speed,
        "reached_speed": round(ticks / TICKS_S / spent_s, 1),
        "sent": PER_TICK * ticks,
        "lost": PER_TICK * ticks - arrived,
        "lost_told": reply.lost,
        "cpu_percent": round(100 * used_s / spent_s),
    }


def _ended() -> TaskStatus:
    return TaskStatus(
        trial=TRIAL, phase="ended", action="", goal_id="", tried=[], plans=0, replans=0,
        scenario_kind="A", actions=[], outcome="success", reason="", violations=[],
    )  # fmt: skip


def _cpu_s(pid: int) -> float:
    """Processor time that a process has used, in all its threads."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
