"""The tick's cost beside its physics: `python -m benchmarks.loop [--trials N] [--json FILE]`.

Runs trials as fast as possible through a whole stack, takes each tick's duration and its
finite-element step from the audit log, and holds the difference against three raw Zenoh hops with
payloads of the same sizes, measured through the same router in the same run.
"""

import argparse
import json
import multiprocessing
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any

import numpy as np
import zenoh

from fras_cli.log_info import tally
from fras_cli.options import build_scenario
from fras_cli.report import read_trial, summarise
from fras_cli.stack import own_stack
from fras_cli.trial import TrialFollower

HOPS = 300
LOOP_KEYS = ("robot/state", "sim/tissue_state", "sa/verdict")


def open_session(connect: str) -> zenoh.Session:
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([connect]))
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


def echo(connect: str, ready: Event, done: Event) -> None:
    """Send back every payload, in a process of its own."""
    with open_session(connect) as session:
        publisher = session.declare_publisher("bench/pong", express=True)
        subscriber = session.declare_subscriber(
            "bench/ping", lambda sample: publisher.put(sample.payload)
        )
        ready.set()
        done.wait()
        subscriber.undeclare()
        publisher.undeclare()


@contextmanager
def echoing(connect: str) -> Iterator[None]:
    context = multiprocessing.get_context("spawn")
    ready, done = context.Event(), context.Event()
    process = context.Process(target=echo, args=(connect, ready, done))
    process.start()
    try:
        if not ready.wait(30):
            raise RuntimeError("the echo process did not start")
        yield
    finally:
        done.set()
        process.join()


def raw_hop_ms(connect: str, size: int) -> np.ndarray:
    """Duration of one hop with `size` bytes: half of a round trip, in milliseconds."""
    back = threading.Event()
    durations: list[float] = []
    with open_session(connect) as session:
        publisher = session.declare_publisher("bench/ping", express=True)
        subscriber = session.declare_subscriber("bench/pong", lambda _: back.set())
        payload = bytes(size)
        while not back.is_set():  # until the echo is matched
            publisher.put(payload)
            back.wait(0.1)
        for _ in range(HOPS):
            back.clear()
            began_s = time.perf_counter()
            publisher.put(payload)
            if not back.wait(5):
                raise RuntimeError("a raw hop got lost")
            durations.append((time.perf_counter() - began_s) * 1e3 / 2)
        subscriber.undeclare()
        publisher.undeclare()
    return np.array(durations)


def overhead_ms(log: Path) -> np.ndarray:
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


def percentiles(values: np.ndarray) -> dict[str, float]:
    p50, p99 = np.percentile(values, [50, 99])
    return {"p50": round(float(p50), 3), "p99": round(float(p99), 3)}


def measure(trials: int) -> dict[str, Any]:
    overheads: list[np.ndarray] = []
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
        keys = tally(log)
        sizes = [round(keys[key].size_bytes / keys[key].messages) for key in LOOP_KEYS]
        with echoing(stack.link.connect):
            hops = sum((raw_hop_ms(stack.link.connect, size) for size in sizes), np.zeros(HOPS))
    overhead, raw = percentiles(np.concatenate(overheads)), percentiles(hops)
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
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=10)
    parser.add_argument("--json", type=Path, help="also write the figures there")
    options = parser.parse_args()
    figures = measure(options.trials)
    width = max(map(len, figures))
    for name, value in figures.items():
        print(f"{name:{width}}  {value}")
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
