"""How late a replay's messages go out at rate 1, and how fast they go at most.

Records a trial at its own pace, replays it into a cell of its own over a local router, with a
recorder in a process of its own that hears everything, and takes for each message the time from
when it was due to when the bus had it. Beside it, in the same minute, the same schedule kept by a
loop that only sleeps and looks at the clock: what this machine makes of any schedule just now.
And, where it is allowed, the replay with real-time priority, so that it never waits for a
processor: how late the replay itself is.
"""

import argparse
import gc
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fras_cli.options import build_scenario
from fras_cli.replay import SWITCH_S, router_of
from fras_cli.stack import own_stack
from fras_cli.trial import TrialFollower
from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.service import run_shell
from fras_common.signals import StopFlag
from fras_replay import (
    UNLIMITED,
    Player,
    Recording,
    ReplayHost,
    ReplayService,
    Selection,
    Settings,
    read_recording,
)
from fras_replay.service import LINGER_NS
from fras_replay.waiting import SPIN_NS

NS = 1e9
TARGET_P99_MS = 2.0
Floats = NDArray[np.float64]
Figures = dict[str, Any]


def record(folder: Path) -> Path:
    """Record one trial at its own pace and return its log."""
    with own_stack("bench-replay", None, folder / "logs") as stack:
        follower = TrialFollower(stack)
        follower.start("bench-replay", build_scenario("b"), folder)
        follower.follow(lambda view: None, stop=lambda: False)
    return folder / "audit.mcap"


def percentiles(ms: Floats) -> Figures:
    values = np.percentile(ms, [50, 90, 99, 100])
    return {
        name: round(float(value), 3)
        for name, value in zip(("p50", "p90", "p99", "max"), values, strict=True)
    }


def bare_schedule_ms(due_ns: Floats) -> Floats:
    """Return how late a loop is that keeps the schedule, and does nothing else [ms]."""
    late: list[float] = []
    since_ns = time.monotonic_ns()
    for at_ns in due_ns:
        due = since_ns + int(at_ns)
        if (gap_ns := due - time.monotonic_ns() - SPIN_NS) > 0:
            time.sleep(gap_ns / NS)
        while (now_ns := time.monotonic_ns()) < due:
            pass
        late.append((now_ns - due) / 1e6)
    return np.array(late)


@contextmanager
def listening(cell: str, connect: str) -> Generator[None]:
    """Have a recorder hear everything in the cell, in a process of its own."""
    command = [sys.executable, "-m", "fras_recorder", "--cell", cell, "--connect", connect]
    process = subprocess.Popen([*command, "--log-level", "ERROR"])
    probe = ZenohBus(cell, connect, "bench/probe")
    try:
        while not any(token.startswith("ready/recorder") for token in probe.tokens(5.0)):
            if process.poll() is not None:
                raise RuntimeError("the recorder did not start")
            time.sleep(0.05)
        yield
    finally:
        probe.close()
        process.send_signal(signal.SIGINT)
        process.wait(30)


@contextmanager
def real_time() -> Generator[bool]:
    """Let nothing else of the machine come before this thread, where that is allowed."""
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(1))
    except PermissionError:
        yield False
        return
    try:
        yield True
    finally:
        os.sched_setscheduler(0, *before)


def undisturbed_ms(recording: Recording, connect: str) -> Figures | None:
    """Return how late the replay itself is, when it never waits for a processor [ms]."""
    with real_time() as allowed:
        return percentiles(play(recording, connect, 1.0)[0]) if allowed else None


def play(recording: Recording, connect: str, rate: float) -> tuple[Floats, float]:
    """Replay all of it; returns the lateness [ms] and the time it took [s]."""
    cell, instance = f"bench-{uuid.uuid4().hex[:6]}", "bench"
    timeline = recording.timeline
    player = Player(timeline, timeline.begin, timeline.end, rate=rate)
    host = ReplayHost()
    with listening(cell, connect):
        bus = ZenohBus(cell, connect, f"replay/{instance}")
        try:
            host.attach(bus)
            service = ReplayService(host, recording, player, Settings(cell, instance))
            gc.collect()
            began_ns = time.monotonic_ns()
            run_shell(host, service, StopFlag())
            took_ns = time.monotonic_ns() - began_ns - LINGER_NS
        finally:
            bus.close()
    return service.lateness.ms(), took_ns / NS


def measure(log: Path, runs: int) -> Figures:
    recording = read_recording(log, Selection())
    try:
        due_ns = np.array(recording.timeline.due_ns, dtype=np.float64)
        rows: list[Figures] = []
        with router_of("bench-replay-router", None, lambda: False) as connect:
            for _ in range(runs):
                bare = bare_schedule_ms(due_ns)
                late, _ = play(recording, connect, 1.0)
                _, fast_s = play(recording, connect, UNLIMITED)
                rows.append(
                    {
                        "late_ms": percentiles(late),
                        "bare_loop_ms": percentiles(bare),
                        "late_real_time_ms": undisturbed_ms(recording, connect),
                        "load": round(os.getloadavg()[0], 1),
                        "fast_messages_s": round(len(due_ns) / fast_s),
                        "fast_times_real": round(recording.timeline.duration_ns / NS / fast_s, 1),
                    }
                )
        # Of several runs, since any of them may have met with other work on the machine.
        p99 = float(np.median([row["late_ms"]["p99"] for row in rows]))
        return {
            "messages": len(due_ns),
            "duration_s": round(recording.timeline.duration_ns / NS, 2),
            "runs": rows,
            "median_p99_ms": p99,
            "target_p99_ms": TARGET_P99_MS,
            "target": "met" if p99 < TARGET_P99_MS else "MISSED",
        }
    finally:
        recording.close()


def show(figures: Figures) -> None:
    print(f"{figures['messages']} messages in {figures['duration_s']} s")
    for number, row in enumerate(figures["runs"], 1):
        late, bare, alone = row["late_ms"], row["bare_loop_ms"], row["late_real_time_ms"]
        print(
            f"run {number}: late by {late['p50']} ms p50, {late['p99']} ms p99, {late['max']} ms "
            f"at most; a bare loop {bare['p50']}, {bare['p99']}, {bare['max']} ms; "
            + (f"real-time {alone['p50']}, {alone['p99']}, {alone['max']} ms; " if alone else "")
            + f"load {row['load']}; as fast as possible {row['fast_messages_s']} messages a "
            f"second, {row['fast_times_real']} times real time"
        )
    print(
        f"median of their p99 {figures['median_p99_ms']} ms, target {figures['target_p99_ms']} ms: "
        f"{figures['target']}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(prog="fras bench replay", description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--log", type=Path, help="a log to replay instead of a new trial's")
    parser.add_argument("--json", type=Path, help="also write the figures there")
    options = parser.parse_args()
    sys.setswitchinterval(SWITCH_S)
    with tempfile.TemporaryDirectory() as folder:
        figures = measure(options.log or record(Path(folder)), options.runs)
    show(figures)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
