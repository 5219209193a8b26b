"""Results folders as a campaign's engine writes them, of trials that are made up."""

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

COLUMNS: Final = (
    *("outcome", "reason", "scenario_kind", "complete", "visibility", "max_force_n"),
    *("soft_limit_n", "hard_limit_n", "crossings", "longest_above_ticks", "plans", "replans"),
    *("actions", "ticks", "grasp_block", "grasp_x_m", "grasp_y_m", "roi_x_m", "roi_y_m", "lift_m"),
    *("patient_max_force_n", "patient_above_ticks", "missed_ticks", "needless_ticks"),
    "log",
)
PLAIN: Final[dict[str, Any]] = {
    "campaign": "made-up", "scenario": "default", "outcome": "success", "reason": "visible",
    "scenario_kind": "A", "complete": "true", "visibility": 0.97, "max_force_n": 0.3,
    "soft_limit_n": 0.5, "hard_limit_n": 1, "crossings": 0, "longest_above_ticks": 0, "plans": 2,
    "replans": 0, "actions": 3, "ticks": 300, "grasp_block": "b(4,4)", "grasp_x_m": 0.05,
    "grasp_y_m": 0.06, "roi_x_m": 0.03, "roi_y_m": 0.05, "lift_m": 0.05, "log": "",
    "patient_max_force_n": "", "patient_above_ticks": "", "missed_ticks": "", "needless_ticks": "",
}  # fmt: skip


def table(path: Path, header: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, header, lineterminator="\n", extrasaction="raise")
        writer.writeheader()
        writer.writerows(rows)


def results_folder(
    folder: Path,
    rows: Sequence[Mapping[str, Any]],
    *,
    swept: Sequence[str] = (),
    series: Mapping[int, Sequence[tuple[int, float, float, float]]] | None = None,
    timing: Sequence[Mapping[str, Any]] | None = None,
    fixed: str = "",
) -> Path:
    """Write a folder; a row has what it does not state from `PLAIN`, its place as its trial."""
    folder.mkdir(parents=True, exist_ok=True)
    header = ["campaign", "trial", "scenario", "seed", *swept, *COLUMNS]
    whole = [{**PLAIN, "trial": i, "seed": i, **row} for i, row in enumerate(rows)]
    table(folder / "trials.csv", header, whole)
    (folder / "campaign.toml").write_text(
        f'[campaign]\nname = "made-up"\nscenario = "default"\nseeds = "0..9"\n[set]\n{fixed}\n'
    )
    if series is not None:
        (folder / "series").mkdir(exist_ok=True)
        for trial, points in series.items():
            lines = "".join(f"{t},{h:.9g},{f:.9g},{v:.9g}\n" for t, h, f, v in points)
            (folder / "series" / f"{trial}.csv").write_text(
                "tick,height_m,force_n,visibility\n" + lines
            )
    if timing is not None:
        times = ("wall_s", "cpu_s", "plan_first_s", "plan_median_s")
        times += ("plan_service_s", "replan_move_s", "replan_release_s")
        table(folder / "timing.csv", ("trial", "worker", *times), timing)
    return folder


def lifted(
    force_per_m: float, *, begin: int = 100, limit_n: float | None = 0.5, top_m: float = 0.05
):
    """Points of a pull whose force grows with its height, kept every fifth tick."""
    points = list[tuple[int, float, float, float]]()
    for step, height in enumerate(np.arange(0.0, top_m + 1e-9, 0.002)):
        force = force_per_m * height
        if limit_n is not None and force > limit_n:
            break
        points.append((begin + 5 * step, float(height), force, min(1.0, height / 0.04)))
    return points


def drawn_campaign(folder: Path, *, trials: int = 100, seed: int = 1, better: float = 0.0) -> Path:
    """Write a campaign like `retraction`: each seed twice, attachments heeded and ignored."""
    random = np.random.default_rng(seed)
    scene = np.random.default_rng(99)
    rows, series, timing = [], {}, []
    for s in range(trials):
        roi = scene.uniform([0.015, 0.015], [0.085, 0.105])
        steep = float(scene.lognormal(2.1, 0.45))
        for ignoring in (False, True):
            i = len(rows)
            force_per_m = steep * (2.2 if ignoring else 1.0) * (1.0 - better)
            points = lifted(force_per_m)
            crossed = 0.05 * force_per_m > 0.5
            kind = "A" if not crossed else "C" if ignoring else "B"
            if kind == "C":
                points += lifted(steep, begin=1000)
            block = (random.integers(7, size=2) + 0.5) / 7 * [0.1, 0.12]
            seen = 1.0 - float(random.exponential(0.02 if not crossed else 0.05))
            late = float(random.exponential(0.03))
            failed = random.uniform() < (0.08 - 0.06 * better)
            rows.append(
                {
                    "seed": s, "planner.ignore_ap": str(ignoring).lower(), "scenario_kind": kind,
                    "visibility": f"{max(0.0, seen - 0.4 * failed):.9g}",
                    "outcome": "failed" if failed else "success",
                    "reason": "replans" if failed else "visible",
                    "max_force_n": f"{min(0.05 * force_per_m, 0.52 + late):.9g}",
                    "crossings": int(crossed), "longest_above_ticks": 4 * int(crossed),
                    "replans": int(crossed), "lift_m": points[-1][1],
                    "grasp_x_m": block[0], "grasp_y_m": block[1],
                    "roi_x_m": roi[0], "roi_y_m": roi[1],
                }
            )  # fmt: skip
            series[i] = points
            timing.append(
                {
                    "trial": i, "worker": 0, "wall_s": 3.1, "cpu_s": 5.2,
                    "plan_first_s": 0.002 * random.lognormal(0, 0.2), "plan_median_s": 0.002,
                }
            )  # fmt: skip
    return results_folder(folder, rows, swept=["planner.ignore_ap"], series=series, timing=timing)
