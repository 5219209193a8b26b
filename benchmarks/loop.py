"""The tick's cost beside its physics: `python -m benchmarks.loop [--trials N] [--json FILE]`.

Runs trials as fast as possible through a whole stack, takes each tick's duration and its
finite-element step from the audit log, and holds the difference against a round of plain Zenoh
through three processes with payloads of the same sizes, through the same router in the same run.
"""

# Zenoh's stubs leave some types open.
# pyright: reportUnknownMemberType=false

import argparse
import json
import multiprocessing
import tempfile
import threading
import time
from collections.abc import Generator
from contextlib import contextmanager
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any

import numpy as np
import zenoh
from benchmarks.telling import tell_figures
from numpy.typing import NDArray

from fras_cli.log_info import tally
from fras_cli.options import build_scenario
from fras_cli.report import read_trial, summarise
from fras_cli.stack import own_stack
from fras_cli.trial import TrialFollower

ROUNDS = 500
Floats = NDArray[np.float64]
LOOP_KEYS = ("robot/state", "sim/tissue_state", "sa/verdict")


def open_session(connect: str) -> zenoh.Session:
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([connect]))
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


def relay(connect: str, hear: str, say: str, size: int, ready: Event, done: Event) -> None:
    """Answer each sample on `hear` with `size` bytes on `say`, in a process of its own."""
    with open_session(connect) as session:
        publisher = session.declare_publisher(say, express=True)
        payload = bytes(size)

        def answer(_: zenoh.Sample) -> None:
            publisher.put(payload)

        subscriber = session.declare_subscriber(hear, answer)
        ready.set()
        done.wait()
        subscriber.undeclare()
        publisher.undeclare()


@contextmanager
def relays(connect: str, sizes: list[int]) -> Generator[None]:
    """Two relays, as sim and SA stand between a robot state and its verdict."""
    context = multiprocessing.get_context("spawn")
    done = context.Event()
    started: list[Any] = []
    for number, size in enumerate(sizes):
        ready = context.Event()
        arguments = (connect, f"bench/{number}", f"bench/{number + 1}", size, ready, done)
        process = context.Process(target=relay, args=arguments)
        process.start()
        started.append(process)
        if not ready.wait(30):
            raise RuntimeError("a relay did not start")
    try:
        yield
    finally:
        done.set()
        for process in started:
            process.join()


def three_raw_hops_ms(connect: str, sizes: list[int]) -> Floats:
    """Duration of a round through three processes with plain Zenoh and nothing else [ms]."""
    back = threading.Event()
    durations: list[float] = []
    with relays(connect, sizes[1:]), open_session(connect) as session:
        publisher = session.declare_publisher("bench/0", express=True)
        subscriber = session.declare_subscriber("bench/2", lambda _: back.set())
        payload = bytes(sizes[0])
        while not back.is_set():  # until the relays are matched
            publisher.put(payload)
            back.wait(0.1)
        for _ in range(ROUNDS):
            back.clear()
            began_s = time.perf_counter()
            publisher.put(payload)
            if not back.wait(5):
                raise RuntimeError("a raw round got lost")
            durations.append((time.perf_counter() - began_s) * 1e3)
        subscriber.undeclare()
        publisher.undeclare()
    return np.array(durations)


def overhead_ms(log: Path) -> Floats:
    """Each tick's duration less its finite-element step, in milliseconds."""
    trial = read_trial(log)
    fe_ms = {tissue.tick: tissue.wall_s * 1e3 for tissue in trial.tissue}
    return np.array(
        [
            (state.stamp_ns - before.stamp_ns) / 1e6 - fe_ms[before.tick]
            for before, state in zip(trial.robot, trial.robot[1:], strict=False)
            if before.goal_id == state.goal_id != "" and before.tick in fe_ms
        ]
    )


def percentiles(values: Floats) -> dict[str, float]:
    p50, p99 = np.percentile(values, [50, 99])
    return {"p50": round(float(p50), 3), "p99": round(float(p99), 3)}


def measure(trials: int) -> dict[str, Any]:
    overheads: list[Floats] = []
    startup_s: list[float] = []
    speed: list[float] = []
    with tempfile.TemporaryDirectory() as name, own_stack("bench", None, Path(name)) as stack:
        follower = TrialFollower(stack)
        for seed in range(1, trials + 1):
            folder = Path(name) / str(seed)
            follower.start(f"bench-{seed}", build_scenario("default", seed=seed, pace=0), folder)
            follower.follow(lambda view: None, stop=lambda: False)
            log = folder / "audit.mcap"
            overheads.append(overhead_ms(log))
            summary = summarise(read_trial(log))
            speed.append(summary.sim_s / summary.wall_s)
            if summary.startup_s is not None:
                startup_s.append(summary.startup_s)
            print(f"trial {seed} of {trials}: {summary.ticks} ticks", flush=True)
        keys = tally(Path(name) / "1" / "audit.mcap")
        sizes = [round(keys[key].size_bytes / keys[key].messages) for key in LOOP_KEYS]
        raw = percentiles(three_raw_hops_ms(stack.link.connect, sizes))
    overhead = percentiles(np.concatenate(overheads))
    return {
        "trials": trials,
        "ticks": int(sum(map(len, overheads))),
        "overhead_ms": overhead,
        "three_raw_hops_ms": raw,
        "ratio_p50": round(overhead["p50"] / raw["p50"], 2),
        "payload_bytes": dict(zip(LOOP_KEYS, sizes, strict=True)),
        "startup_s": round(startup_s[0], 2) if startup_s else None,
        "simulated_over_wall": round(float(np.median(speed)), 2),
    }


def main() -> None:
    parser = argparse.ArgumentParser(prog="fras bench loop", description=__doc__)
    parser.add_argument("--trials", type=int, default=10)
    parser.add_argument("--json", type=Path, help="also write the figures there")
    options = parser.parse_args()
    figures = measure(options.trials)
    tell_figures(figures, options.json)


if __name__ == "__main__":
    main()
