"""Does the mesh decide the force: one pull on three meshes, the finest as the reference.

Attachments and grasp are rectangles whose edges lie on nodes of every mesh, so that all meshes are
of the same body; the grasped square of the top goes up by 50 mm at 20 mm/s. Printed is the force
of the tool at 20 and 50 mm, and how far it is from that of the finest mesh.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.fe_task import CLOSED_RAD, LIFT_PER_TICK_M, TICKS
from numpy.typing import NDArray

from fras_sim.fem import ArmState, Mesh, TissueParameters, TissueSimulator, ToolInput, box_mesh

MESHES = ((21, 25, 2), (21, 25, 3), (41, 49, 3))
HEIGHTS_M = (0.02, 0.05)
TO_REACH = 0.03
# Attached rectangles of the bottom and the grasped one of the top: x from, to, y from, to [m].
Rectangle = tuple[float, float, float, float]
CORNER_OF_TWO_SIDES: tuple[Rectangle, ...] = ((0.0, 0.1, 0.0, 0.03), (0.0, 0.03, 0.0, 0.12))
SCENES: dict[str, tuple[tuple[Rectangle, ...], Rectangle]] = {
    "two sides": (CORNER_OF_TWO_SIDES, (0.065, 0.085, 0.075, 0.095)),
    "two sides, small grasp": (CORNER_OF_TWO_SIDES, (0.07, 0.08, 0.08, 0.09)),
    "one end, at the corner": (((0.0, 0.1, 0.0, 0.04),), (0.08, 0.1, 0.1, 0.12)),
    "one side, at the edge": (((0.0, 0.04, 0.0, 0.12),), (0.08, 0.1, 0.05, 0.07)),
    "three sides": (
        ((0.0, 0.1, 0.0, 0.02), (0.0, 0.02, 0.0, 0.12), (0.08, 0.1, 0.0, 0.12)),
        (0.04, 0.06, 0.09, 0.11),
    ),
}
ROUNDING_M = 1e-9


def nodes_in(mesh: Mesh, rectangle: Rectangle, height_m: float) -> NDArray[np.int32]:
    x0, x1, y0, y1 = rectangle
    lower = np.array([x0, y0, height_m]) - ROUNDING_M
    upper = np.array([x1, y1, height_m]) + ROUNDING_M
    inside = ((mesh.nodes_m >= lower) & (mesh.nodes_m <= upper)).all(axis=1)
    return np.flatnonzero(inside).astype(np.int32)


def pull(counts: tuple[int, int, int], scene: str) -> dict[float, float]:
    """Return the tool's upward force [N] at each height [m]."""
    attached, grasped = SCENES[scene]
    mesh = box_mesh(node_counts=counts)
    top_m = float(mesh.nodes_m[:, 2].max())
    fixed = np.unique(np.concatenate([nodes_in(mesh, one, 0.0) for one in attached]))
    held = nodes_in(mesh, grasped, top_m)
    tip_m = mesh.nodes_m[held].mean(axis=0)
    tissue = TissueSimulator(mesh, TissueParameters(), fixed)
    tissue.measure({"psm1": ToolInput(tip_m, CLOSED_RAD)})
    arm = ArmState(tip_m, True, held, mesh.nodes_m[held] - tip_m)
    tissue.restore(replace(tissue.checkpoint(), arms={"psm1": arm}))
    force_n: dict[float, float] = {}
    for tick in range(1, TICKS + 1):
        lift_m = tick * LIFT_PER_TICK_M
        at_m = tip_m + np.array([0.0, 0.0, lift_m])
        result = tissue.step({"psm1": ToolInput(at_m, CLOSED_RAD)})
        if not result.solver.converged:
            raise RuntimeError(f"{scene}, {counts}: tick {tick} did not converge")
        for height_m in HEIGHTS_M:
            if abs(lift_m - height_m) < ROUNDING_M:
                force_n[height_m] = float(result.tool_force_n["psm1"][2])
    return force_n


def main() -> None:
    parser = argparse.ArgumentParser(prog="fras bench mesh", description=__doc__)
    parser.add_argument("--json", type=Path, help="also write the figures there")
    options = parser.parse_args()
    head = "".join(f"{f'{1e3 * h:.0f} mm [N]':>11}{'off':>8}" for h in HEIGHTS_M)
    print(f"{'scene':25}{'mesh':>9}{head}")
    figures: dict[str, Any] = {}
    for scene in SCENES:
        forces = {counts: pull(counts, scene) for counts in MESHES}
        finest = forces[MESHES[-1]]
        for counts, force_n in forces.items():
            name = "x".join(map(str, counts))
            off = {h: force_n[h] / finest[h] - 1.0 for h in HEIGHTS_M}
            figures.setdefault(scene, {})[name] = {
                f"{1e3 * h:.0f} mm": {"force_n": force_n[h], "off": off[h]} for h in HEIGHTS_M
            }
            row = "".join(f"{force_n[h]:11.4f}{off[h]:8.1%}" for h in HEIGHTS_M)
            print(f"{scene:25}{name:>9}{row}", flush=True)
    worst = max(
        abs(entry["off"]) for scene in figures.values() for entry in scene["21x25x3"].values()
    )
    print(f"21x25x3 is at most {worst:.1%} from 41x49x3; to reach: {TO_REACH:.0%}")
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
