"""What certificates cost: `python -m benchmarks.secure [--trials N] [--json FILE]`.

A plain stack and one with certificates and access control stand side by side and run the same
trials in turn, as fast as possible, so that a noisy machine disturbs both alike. The tick is the
time from one robot state to the next, all services and the recorder included.
"""

import argparse
import tempfile
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.loop import Floats, overhead_ms, percentiles
from benchmarks.telling import tell_figures

from fras_cli.layout import USUAL, Layout
from fras_cli.options import build_scenario
from fras_cli.report import read_trial
from fras_cli.stack import UsedStack, own_stack
from fras_cli.trial import TrialFollower

TARGET = 1.3


def ticks_ms(log: Path) -> Floats:
    """Each tick's duration within an action, in milliseconds."""
    robot = read_trial(log).robot
    return np.array(
        [
            (state.stamp_ns - before.stamp_ns) / 1e6
            for before, state in pairwise(robot)
            if before.goal_id == state.goal_id != ""
        ]
    )


class Runner:
    """One of the stacks, and what its trials took."""

    def __init__(self, stack: UsedStack, folder: Path) -> None:
        self._follower = TrialFollower(stack)
        self._folder = folder
        self.ticks: list[Floats] = []
        self.overheads: list[Floats] = []

    def run(self, seed: int) -> None:
        """Run a trial."""
        folder = self._folder / str(seed)
        scenario = build_scenario("default", seed=seed, pace=0)
        self._follower.start(f"secure-{seed}", scenario, folder)
        self._follower.follow(lambda view: None, stop=lambda: False)
        self.ticks.append(ticks_ms(folder / "audit.mcap"))
        self.overheads.append(overhead_ms(folder / "audit.mcap"))


def measure(seeds: Iterable[int]) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        secure = Layout(keys=folder / "keys")
        with (
            own_stack("bench-plain", None, folder / "plain" / "logs", layout=USUAL) as one,
            own_stack("bench-secure", None, folder / "secure" / "logs", layout=secure) as other,
        ):
            runners = {
                "plain": Runner(one, folder / "plain"),
                "secure": Runner(other, folder / "secure"),
            }
            for number, seed in enumerate(seeds, start=1):
                # Neither is always the first.
                for kind in sorted(runners, reverse=number % 2 == 0):
                    runners[kind].run(seed)
                print(f"pair {number}: {sum(map(len, runners['plain'].ticks))} ticks", flush=True)
    ticks = {kind: percentiles(np.concatenate(one.ticks)) for kind, one in runners.items()}
    overheads = {kind: percentiles(np.concatenate(one.overheads)) for kind, one in runners.items()}
    return {
        "ticks": sum(map(len, runners["plain"].ticks)),
        "tick_ms": ticks,
        "overhead_ms": overheads,
        "tick_ratio_p50": round(ticks["secure"]["p50"] / ticks["plain"]["p50"], 2),
        "overhead_ratio_p50": round(overheads["secure"]["p50"] / overheads["plain"]["p50"], 2),
        "target": TARGET,
    }


def main() -> None:
    parser = argparse.ArgumentParser(prog="fras bench secure", description=__doc__)
    parser.add_argument("--trials", type=int, default=10, help="of each kind")
    parser.add_argument("--json", type=Path, help="also write the figures there")
    options = parser.parse_args()
    figures = measure(range(1, options.trials + 1))
    tell_figures(figures, options.json)


if __name__ == "__main__":
    main()
