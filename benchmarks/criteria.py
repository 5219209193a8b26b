"""Where each criterion grasps: `fras bench criteria`.

Draws the scenes of many seeds as a trial would (the default scenario's tissue, attachments and
region of interest), asks the planner with each criterion for its first plan, and tells how far
from the attachments and from the region of interest it grasps, and how often at the tissue's
corners or beside an attachment.
"""
# pyright: reportUnknownMemberType=false
# Reason: matplotlib's stubs leave some types open.

import argparse
import json
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fras_common.scenario import Scenario, resolve
from fras_common.scenario.geometry import attachment_raster
from fras_planner.knowledge import load_knowledge
from fras_planner.planning import Planner, PlanningScene

mpl.use("Agg")

SCENES = 400
N = 7
Floats = NDArray[np.float64]


def scene_of(seed: int) -> tuple[PlanningScene, Floats]:
    """Draw a scene; its blocks, and the attachment points [m]."""
    scenario = resolve(Scenario(seed=seed))
    size_m = np.array(scenario.tissue.size_m)
    drawn = scenario.scene
    if drawn is None:
        raise RuntimeError("a resolved scenario has a scene")
    points = attachment_raster(scenario.tissue.size_m, drawn.discs)
    cell_m = size_m[:2] / N
    rows = [(i, j) for i in range(N) for j in range(N)]
    names = [f"b({i + 1},{j + 1})" for i, j in rows]
    centres = np.array([((i + 0.5) * cell_m[0], (j + 0.5) * cell_m[1], size_m[2]) for i, j in rows])
    attached = {
        tuple(cell) for cell in (points[:, :2] // cell_m).astype(int).clip(0, N - 1).tolist()
    }
    over = tuple((np.array(drawn.roi_m[:2]) // cell_m).astype(int).tolist())
    statics = [f"fixed({name})" for name, row in zip(names, rows, strict=True) if row in attached]
    statics.append(f"above_roi({names[rows.index(over)]})")
    for name, centre in zip(names, centres, strict=True):
        arm = "psm1" if centre[1] < size_m[1] / 2 - 1e-9 else "psm2"
        statics.append(f"reachable({arm},{name})")
    return PlanningScene.make(names, centres, drawn.roi_m, statics), points


def grasps(criterion: str, scenes: list[tuple[PlanningScene, Floats]]) -> dict[str, Any]:
    """Count where a criterion grasps."""
    knowledge = load_knowledge()
    counts = np.zeros((N, N), dtype=int)
    gaps_m: list[float] = []
    ways_m: list[float] = []
    beside = 0
    for scene, points in scenes:
        target = Planner(knowledge, scene, criterion).plan([]).target
        if not target:
            continue
        row = scene.names.index(target)
        i, j = divmod(row, N)
        counts[i, j] += 1
        centre = np.array(scene.blocks_m[row])[:2]
        ways_m.append(float(np.linalg.norm(centre - np.array(scene.roi_m[:2]))))
        if len(points):
            gaps_m.append(float(np.linalg.norm(points[:, :2] - centre, axis=1).min()))
        around = [(i + a, j + b) for a in (-1, 0, 1) for b in (-1, 0, 1)]
        beside += any(f"fixed(b({a + 1},{b + 1}))" in scene.statics for a, b in around)
    total = int(counts.sum())
    corners = int(counts[[0, 0, -1, -1], [0, -1, 0, -1]].sum())
    return {
        "grasps": total,
        "at_a_corner": corners / total,
        "beside_an_attachment": beside / total,
        "to_the_nearest_attachment_mm": 1e3 * float(np.mean(gaps_m)),
        "to_the_roi_mm": 1e3 * float(np.mean(ways_m)),
        "counts": counts.tolist(),
    }


def draw(results: dict[str, dict[str, Any]], path: Path) -> None:
    figure = Figure(figsize=(3.0 * len(results), 3.6), layout="constrained")
    axes = figure.subplots(1, len(results), squeeze=False)[0]
    most = max(max(map(max, row["counts"])) for row in results.values())
    image = None
    for axis, (name, row) in zip(axes, results.items(), strict=True):
        image = axis.imshow(
            np.array(row["counts"]).T, origin="lower", cmap="viridis", vmin=0, vmax=most
        )
        axis.set_title(
            f"{name}\n{row['at_a_corner']:.0%} at a corner\n"
            f"{row['beside_an_attachment']:.0%} beside an attachment",
            fontsize=10,
        )
        axis.set_xticks(range(N), [str(k + 1) for k in range(N)])
        axis.set_yticks(range(N), [str(k + 1) for k in range(N)])
        axis.set_xlabel("i")
    axes[0].set_ylabel("j")
    if image is not None:
        figure.colorbar(image, ax=list(axes), label="grasps", shrink=0.8)
    figure.savefig(path, dpi=120)


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="fras bench criteria",
        description=(__doc__ or "").partition("\n\n")[2],
    )
    parser.add_argument("--scenes", type=int, default=SCENES, help="seeds 1 to this")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("runs/bench"),
        help="folder for criteria.json and criteria.png (default: runs/bench)",
    )
    options = parser.parse_args()
    scenes = [scene_of(seed) for seed in range(1, options.scenes + 1)]
    results: dict[str, dict[str, Any]] = {}
    for criterion in load_knowledge().criteria:
        results[criterion] = grasps(criterion, scenes)
        print(f"  {criterion} done", flush=True)
    print(f"{'criterion':10} {'corner':>7} {'beside AP':>10} {'nearest AP':>11} {'ROI':>7}")
    for name, row in results.items():
        print(
            f"{name:10} {row['at_a_corner']:7.0%} {row['beside_an_attachment']:10.0%} "
            f"{row['to_the_nearest_attachment_mm']:8.1f} mm {row['to_the_roi_mm']:4.1f} mm"
        )
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "criteria.json").write_text(json.dumps(results, indent=1) + "\n")
    draw(results, options.out / "criteria.png")
    print(f"written: {options.out / 'criteria.json'}, {options.out / 'criteria.png'}")


if __name__ == "__main__":
    main()
