"""Trials without end: `fras bench soak [--trials N] [--page] [--json FILE] [--figure FILE]`.

One stack, one trial after another as fast as possible; after each, what every process uses: memory
of its own (USS), descriptors, threads, open files, and what its health counts. Flat is what rises
by less than a bound with each trial of the second half (`benchmarks/soak_verdict.py`).
"""

# matplotlib ships no complete types.
# pyright: reportUnknownMemberType=false

import argparse
import json
import os
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Generator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
from benchmarks.machine import processor
from benchmarks.soak_samples import STACK, Watch
from benchmarks.soak_verdict import BOUNDS, Judged, judge
from rich.console import Console
from rich.table import Table

from fras_cli.link import Link
from fras_cli.options import build_scenario
from fras_cli.stack import own_stack
from fras_cli.trial import TrialFollower, TrialView

SCENES: Final = 20
SHOWN: Final = ("memory_mib", "descriptors", "threads", "files")
COUNTED: Final = ("gaps", "dropped", "malformed", "refused")

Sample = dict[str, dict[str, float]]


@contextmanager
def looked_at(link: Link, wanted: bool) -> Generator[dict[str, int]]:
    """Have a surgeon's page open, whose client draws nothing; yields its process by name."""
    if not wanted:
        yield {}
        return
    # Not at the top: the rest needs no browser's library.
    from benchmarks.page_jobs import watched
    from benchmarks.surgeon import served

    with served(link) as page, watched(page.address):
        yield {"monitor": page.process.pid}


def soak(
    trials: int, mesh: str | None, console: Console, *, page: bool
) -> tuple[list[dict[str, Any]], float]:
    """Run the trials; what was seen after each, and how long the stack took to be ready [s]."""
    rows: list[dict[str, Any]] = []
    began_s = time.monotonic()
    with ExitStack() as inside:
        name = inside.enter_context(tempfile.TemporaryDirectory())
        stack = inside.enter_context(own_stack("soak", None, Path(name)))
        ready_s = time.monotonic() - began_s
        others = inside.enter_context(looked_at(stack.link, page))
        follower, watch = TrialFollower(stack), Watch(stack.link.bus, others)
        console.print(f"ready after {ready_s:.1f} s")
        for number in range(trials):
            seed = 1 + number % SCENES
            folder = Path(name) / "trial"
            scenario = build_scenario("default", seed=seed, pace=0, mesh=mesh)
            view = _one_trial(follower, f"soak-{number}", scenario, folder)
            shutil.rmtree(folder)
            used = watch.sample(Path(name))
            row = {"trial": number + 1, "seed": seed, **view, "sample": used}
            rows.append(row)
            memory = ", ".join(
                f"{one} {seen['memory_mib']:.0f}" for one, seen in used.items() if one != STACK
            )
            console.print(
                f"trial {number + 1} of {trials}: {row['outcome']}, {row['ticks']} ticks in "
                f"{row['wall_s']:.1f} s; MiB: {memory}",
                style="dim",
                soft_wrap=True,
            )
    return rows, ready_s


def _one_trial(follower: TrialFollower, name: str, scenario: Any, folder: Path) -> dict[str, Any]:
    views: list[TrialView] = []
    began_s = time.monotonic()
    follower.start(name, scenario, folder)
    follower.follow(views.append, stop=lambda: False)
    last = views[-1]
    return {
        "outcome": last.task.outcome if last.task is not None else "",
        "ticks": last.robot.tick if last.robot is not None else 0,
        "wall_s": round(time.monotonic() - began_s, 3),
    }


def series(rows: Sequence[dict[str, Any]], process: str, quantity: str) -> list[float]:
    """One quantity of one process over the trials."""
    return [row["sample"][process][quantity] for row in rows]


def judged(rows: Sequence[dict[str, Any]]) -> list[Judged]:
    """Judge each quantity that has a bound, of each process."""
    return [
        judge(process, quantity, series(rows, process, quantity))
        for process, seen in rows[0]["sample"].items()
        for quantity in seen
        if quantity in BOUNDS
    ]


def table_of(verdicts: Sequence[Judged]) -> Table:
    """Lay the figures out for people: after the first trial, half of them, the last."""
    table = Table("process", "MiB of its own", "KiB a trial", "fds", "threads", "files", "verdict")
    of: dict[str, dict[str, Judged]] = {}
    for one in verdicts:
        of.setdefault(one.process, {})[one.quantity] = one
    for process, seen in of.items():
        memory = seen["logs_mib" if process == STACK else "memory_mib"]
        rising = [one.quantity for one in seen.values() if not one.is_flat]
        table.add_row(
            "log files" if process == STACK else process,
            " → ".join(f"{value:.1f}" for value in (memory.first, memory.middle, memory.last)),
            f"{memory.slope * 1024:+.1f}",
            *(_course(seen.get(quantity)) for quantity in SHOWN[1:]),
            f"rises: {', '.join(rising)}" if rising else "flat",
        )
    return table


def _course(one: Judged | None) -> str:
    if one is None:
        return ""
    values = (one.first, one.middle, one.last)
    steady = all(before == after for before, after in pairwise(values))
    return f"{one.last:.0f}" if steady else " → ".join(f"{value:.0f}" for value in values)


def counted(verdicts: Sequence[Judged]) -> dict[str, str]:
    """What services have counted that should not be: who, and how often."""
    found: dict[str, str] = {}
    for quantity in COUNTED:
        told = [
            f"{one.process} {one.last:.0f}"
            for one in verdicts
            if one.quantity == quantity and one.last
        ]
        found[quantity] = ", ".join(told) or "none"
    return found


def draw(rows: Sequence[dict[str, Any]], path: Path) -> None:
    """Write the picture; its kind follows from the file's name."""
    # Not at the top: the rest needs no figures.
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 7), layout="constrained")
    axes = figure.subplots(3, 1, sharex=True)
    trials = [row["trial"] for row in rows]
    for process in (one for one in rows[0]["sample"] if one != STACK):
        for axis, quantity in zip(axes, SHOWN[:3], strict=True):
            axis.plot(trials, series(rows, process, quantity), label=process, linewidth=1.2)
    for axis, label in zip(axes, ("memory of its own [MiB]", *SHOWN[1:3]), strict=True):
        axis.axvspan(trials[len(trials) // 2], trials[-1], color="0.95")
        axis.set(ylabel=label, ylim=(0, None))
    axes[0].legend(fontsize=8, ncols=4)
    axes[-1].set(xlabel="trials of one stack; judged in the grey half")
    figure.savefig(path, dpi=130)


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Describe how the trials went; a tick must not take longer in the end, either."""
    tick_ms = [row["wall_s"] / max(1, row["ticks"]) * 1e3 for row in rows]
    middle = len(rows) // 2
    return {
        "trials": len(rows),
        "ticks": sum(row["ticks"] for row in rows),
        "outcomes": dict(Counter(row["outcome"] for row in rows)),
        "wall_s": round(sum(row["wall_s"] for row in rows), 1),
        "ms_a_tick_first_half": round(float(np.median(tick_ms[:middle] or tick_ms)), 2),
        "ms_a_tick_second_half": round(float(np.median(tick_ms[middle:])), 2),
    }


def main() -> int:
    parser = argparse.ArgumentParser(prog="fras bench soak", description=__doc__)
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--mesh", metavar="X,Y,Z", help="node counts (default: the scenario's)")
    parser.add_argument("--page", action="store_true", help="with a surgeon's page open")
    parser.add_argument("--json", type=Path, help="also write figures and samples there")
    parser.add_argument("--figure", type=Path, help="also draw them there")
    options = parser.parse_args()
    if options.trials < 1:
        parser.error("--trials: at least one")
    console = Console()
    load_before = os.getloadavg()[0]
    rows, ready_s = soak(options.trials, options.mesh, console, page=options.page)
    verdicts = judged(rows)
    told = {
        **summary(rows),
        **counted(verdicts),
        "ready_s": round(ready_s, 2),
        "load": [round(load_before, 1), round(os.getloadavg()[0], 1)],
    }
    console.print(table_of(verdicts))
    for name, value in told.items():
        console.print(f"{name:24}{value}", highlight=False)
    if options.json:
        made = {
            "processor": processor(),
            "mesh": options.mesh,
            **told,
            "judged": [{**asdict(one), "flat": one.is_flat} for one in verdicts],
            "rows": rows,
        }
        options.json.write_text(json.dumps(made, indent=2) + "\n")
    if options.figure:
        draw(rows, options.figure)
    flat = all(one.is_flat for one in verdicts)
    console.print("flat" if flat else "not flat", style="bold")
    return 0 if flat else 1


if __name__ == "__main__":
    sys.exit(main())
