"""Motion against its limits, and what it takes: `fras bench motion`.

Inverse kinematics of both arms beside damped least squares (Pinocchio's Jacobian, from the joints
of the tick before, to 1e-6); the controller's ticks, timed, and paced against the wall clock;
random actions of both arms with ideal drivers, their setpoints held against every limit; stops at
random ticks; and where both arms reach. Places and rates come from the published table in plain
numpy (`benchmarks/psm_reference.py`), not from motion's own kinematics.
"""

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from time import monotonic
from typing import Any

import matplotlib as mpl
from benchmarks.machine import machine
from benchmarks.motion_jobs import Motion, Recorder, strayed, used_limits
from benchmarks.motion_reach import draw, reachability
from benchmarks.motion_stops import measure_stops
from benchmarks.motion_table import DT_MS, MOTIONS, tables, targets
from benchmarks.motion_times import (
    inverse_from_anywhere,
    inverse_kinematics,
    paced_ticks,
    spread_us,
)
from benchmarks.telling import target_lines, target_rows

mpl.use("Agg")

OUT = Path("runs/bench")
TICKS = 10_000
STOPS = 300
POSES = 1000
TELL_EVERY_S = 10.0
Raw = dict[str, Any]


def progress(what: str, total: int) -> Callable[[int], None]:
    """Make a function that tells now and then how many are done."""
    told_s = monotonic()

    def tell(done: int) -> None:
        nonlocal told_s
        if done == total or monotonic() - told_s >= TELL_EVERY_S:
            told_s = monotonic()
            print(f"{what}: {done:,} of {total:,}", flush=True)

    return tell


def measure(options: argparse.Namespace) -> Raw:
    """Measure everything but the reach."""
    recorder = Recorder(options.seed)
    tell = progress("random motions", options.motions)
    motions: list[Motion] = []
    for number in range(options.motions):
        motions.append(recorder.motion())
        tell(number + 1)
    used = [used_limits(motion, recorder.parameters) for motion in motions]
    strays = [strayed(motion, recorder.parameters) for motion in motions]
    off_line_m, turned_rad, off_target_m = (max(column) for column in zip(*strays, strict=True))
    return {
        "ik": inverse_kinematics(motions, options.ticks),
        "anywhere": inverse_from_anywhere(POSES, options.seed),
        "ticks": {
            "ticks": len(recorder.tick_s),
            "advance": spread_us(recorder.tick_s),
            "longer_than_dt": sum(spent > DT_MS / 1e3 for spent in recorder.tick_s),
            "accept": spread_us(recorder.accept_s),
        },
        "motions": {
            "motions": len(motions),
            "targets_refused": recorder.refused,
            "used": {name: max(row[name] for row in used) for name in used[0]},
            "off_line_m": off_line_m,
            "turned_rad": turned_rad,
            "off_target_m": off_target_m,
        },
        "stops": measure_stops(options.stops, options.seed, progress("stops", options.stops)),
        "paced": paced_ticks(
            options.ticks, options.pace, options.seed, progress("paced ticks", options.ticks)
        ),
    }


def _positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{number}: at least 1")
    return number


def _pace(text: str) -> float:
    number = float(text)
    if not 0.0 < number <= 1000.0:
        raise argparse.ArgumentTypeError(f"{text}: more than 0, at most 1000")
    return number


def main() -> None:
    parser = argparse.ArgumentParser(prog="fras bench motion", description=__doc__)
    parser.add_argument(
        "--motions", type=_positive, default=MOTIONS, help="random actions (default: %(default)s)"
    )
    parser.add_argument(
        "--ticks",
        type=_positive,
        default=TICKS,
        help="of the inverse kinematics and of the paced loop (default: %(default)s)",
    )
    parser.add_argument(
        "--pace",
        type=_pace,
        default=1.0,
        help="simulated seconds a second of the paced loop: 10,000 ticks take 200 s at 1, and a "
        "tick at 2 is late after 10 ms (default: %(default)s)",
    )
    parser.add_argument(
        "--stops", type=_positive, default=STOPS, help="holds at random (default: %(default)s)"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--out",
        type=Path,
        default=OUT,
        help="folder for motion.json and reachability.png (default: %(default)s)",
    )
    options = parser.parse_args()
    maps, reach = reachability()
    report = measure(options) | {"reachability": reach}
    reached = targets(report)
    print(tables(report))
    for arm in ("psm1", "psm2"):
        whole, half = reach[arm]["whole_tissue"], reach[arm]["half_it_serves"]
        print(
            f"{arm}: nearest to a limit over the whole tissue {100 * whole['margin']:.1f} % of its "
            f"range ({whole['joint']}), over its half {100 * half['margin']:.1f} % "
            f"({half['joint']})"
        )
    print(target_lines(reached))
    options.out.mkdir(parents=True, exist_ok=True)
    draw(maps, reach, options.out / "reachability.png")
    setting = {name: value for name, value in vars(options).items() if name != "out"}
    full: Raw = {
        "machine": machine(),
        "setting": setting,
        **report,
        "targets": target_rows(reached),
    }
    (options.out / "motion.json").write_text(json.dumps(full, indent=2) + "\n")
    print(f"written: {options.out / 'motion.json'}, {options.out / 'reachability.png'}")


if __name__ == "__main__":
    main()
