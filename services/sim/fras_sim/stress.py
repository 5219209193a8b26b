"""Try to break the tissue.

Grasps beside and on attachments, pulls 50 mm up and 60 mm sideways, lets go, grasps anew, with one
arm and with both, at several times the speed of a careful surgeon; draws everything from a seed.
Prints what share of the steps converged, whether every number stayed finite and how far from its
rest the tissue ended after each release, and when. Exit status 0 if nothing broke.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem import (
    StepResult,
    TissueParameters,
    TissueSimulator,
    ToolInput,
    box_mesh,
)

LIFT_M, ASIDE_M = 0.05, 0.06
OPEN_RAD, CLOSED_RAD = 1.0, -0.3
AT_REST_M = 1e-4
# Tissue that is caught somewhere stands still there. A large flap without weight that hangs on one
# small attachment creeps home against the drag, by a third in 2 s, and passes 0.1 mm ten times as
# fast as this.
STANDING_STILL_M_S = 1e-6
SETTLING_TICKS = 10_000
ARMS = ("psm1", "psm2")

Vector = NDArray[np.float64]
Tools = dict[str, ToolInput]


@dataclass
class Tally:
    """What came of the steps so far."""

    steps: int = 0
    converged: int = 0
    finite: int = 0
    episodes: int = 0
    furthest_m: float = 0.0
    slowest_ticks: int = 0
    iterations: int = 0

    @property
    def passed(self) -> bool:
        """All finite, at least 99.9 % converged, less than 0.1 mm from rest after each release."""
        enough = self.converged >= 0.999 * self.steps
        return self.finite == self.steps and enough and self.furthest_m < AT_REST_M

    def count(self, result: StepResult) -> None:
        """Take one more step into account."""
        numbers = np.isfinite(result.nodes_m).all() and np.isfinite(result.nodal_force_n).all()
        self.steps += 1
        self.converged += result.solver.converged
        self.finite += bool(numbers)
        self.iterations += result.solver.iterations

    def __str__(self) -> str:
        share = 100.0 * self.converged / max(self.steps, 1)
        return (
            f"{self.steps} steps in {self.episodes} episodes: converged {share:.3f} % "
            f"({self.steps - self.converged} not), finite {self.finite}/{self.steps}, "
            f"{self.iterations / max(self.steps, 1):.2f} corrections a step, "
            f"at most {1e3 * self.furthest_m:.4f} mm from rest after a release, "
            f"reached after at most {self.slowest_ticks} ticks"
        )


def make_tissue(node_counts: tuple[int, int, int], rng: np.random.Generator) -> TissueSimulator:
    """Return a box with two or three round attachments."""
    mesh = box_mesh(node_counts=node_counts)
    bottom_m = mesh.nodes_m[mesh.bottom_nodes, :2]
    is_fixed = np.zeros(len(bottom_m), dtype=bool)
    for _ in range(int(rng.integers(2, 4))):
        centre_m = rng.uniform([0.0, 0.0], [0.1, 0.12])
        is_fixed |= np.linalg.norm(bottom_m - centre_m, axis=1) <= rng.uniform(0.015, 0.03)
    is_fixed[0] |= not is_fixed.any()
    return TissueSimulator(mesh, TissueParameters(), mesh.bottom_nodes[is_fixed])


def episode(tissue: TissueSimulator, rng: np.random.Generator) -> Iterator[Tools]:
    """Yield the tools of one episode: grasp, up, sideways, release, regrasp, release."""
    arms = ARMS if rng.random() < 0.4 else ARMS[:1]
    step_m = rng.uniform(0.0004, 0.0016)
    top_m = tissue.mesh.nodes_m[:, 2].max()
    tips = {arm: _grasp_point(tissue, rng, top_m) for arm in arms}

    def all_at(jaw_rad: float) -> Tools:
        return {arm: ToolInput(tip.copy(), jaw_rad) for arm, tip in tips.items()}

    def move(direction: Vector, length_m: float) -> Iterator[Tools]:
        for _ in range(round(length_m / step_m)):
            for tip in tips.values():
                tip += step_m * direction
            yield all_at(CLOSED_RAD)

    angle = rng.uniform(0.0, 2.0 * np.pi)
    aside = np.array([np.cos(angle), np.sin(angle), 0.0])
    yield all_at(OPEN_RAD)
    yield from move(np.array([0.0, 0.0, 1.0]), LIFT_M)
    yield from move(aside, ASIDE_M)
    yield all_at(OPEN_RAD)
    # The tissue is still on its way when it is grasped again, wherever the tools now are.
    yield from move(-aside, 0.02)
    yield all_at(OPEN_RAD)


def _grasp_point(tissue: TissueSimulator, rng: np.random.Generator, top_m: float) -> Vector:
    """Half of the grasps beside or above an attachment, where elements suffer most."""
    if rng.random() < 0.5:
        near_m = tissue.mesh.nodes_m[rng.choice(tissue.fixed_nodes)] + rng.normal(0.0, 0.005, 3)
    else:
        near_m = rng.uniform([0.0, 0.0, 0.0], [0.1, 0.12, 0.0])
    return np.array([near_m[0], near_m[1], top_m])


def stress(steps: int, node_counts: tuple[int, int, int], seed: int) -> Tally:
    """Play episodes until at least `steps` steps are done; each has a tissue of its own.

    Parameters
    ----------
    steps : int
    node_counts : tuple of int
        Of the box, along x, y, z.
    seed : int
        Decides everything that is drawn.
    """
    rng = np.random.default_rng(seed)
    tally = Tally()
    while tally.steps < steps:
        tissue = make_tissue(node_counts, rng)
        tools: Tools = {}
        result = tissue.measure(tools)
        for tools in episode(tissue, rng):
            result = tissue.step(tools)
            tally.count(result)
        ticks = 0
        while _is_on_its_way(tissue, result) and ticks < SETTLING_TICKS:
            result = tissue.step(tools)
            tally.count(result)
            ticks += 1
        tally.furthest_m = max(tally.furthest_m, _away_m(tissue, result))
        tally.slowest_ticks = max(tally.slowest_ticks, ticks)
        tally.episodes += 1
    return tally


def _is_on_its_way(tissue: TissueSimulator, result: StepResult) -> bool:
    moves = result.max_node_speed_m_s > STANDING_STILL_M_S
    return moves and _away_m(tissue, result) >= AT_REST_M


def _away_m(tissue: TissueSimulator, result: StepResult) -> float:
    return float(np.linalg.norm(result.nodes_m - tissue.mesh.nodes_m, axis=1).max())


def main(arguments: list[str] | None = None) -> int:
    """Read the command line, play, print; return the exit status."""
    parser = argparse.ArgumentParser(prog="fras bench stress", description=__doc__)
    parser.add_argument("--steps", type=int, default=10_000)
    parser.add_argument("--nodes", type=int, nargs=3, default=(21, 25, 2), metavar=("X", "Y", "Z"))
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    tally = stress(options.steps, tuple(options.nodes), options.seed)
    sys.stdout.write(f"{tally}\n{'passed' if tally.passed else 'FAILED'}\n")
    return 0 if tally.passed else 1


if __name__ == "__main__":
    sys.exit(main())
