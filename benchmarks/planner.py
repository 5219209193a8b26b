"""The planner alone, against the paper's way with clingo, on the paper's Table I.

N x N blocks, of which 10 to 70 % are attached in three patches: the first plan (A), and at 50 %
the plans after a crossed limit (B: move sideways; C: let attached tissue go and grasp anew). Each
cell is the mean over random scenes, each plan in milliseconds of wall time, narration included.
`cold` is a new Planner and its first plan, `warm` the same Planner asked again in other states.
The baseline is written from the paper's text (`benchmarks/planner_baseline.*`): `fresh` takes a
new Control for each number of steps, `one` a new Control for each plan. All rank blocks by the
criterion `literal`, the paper's formula as printed, and their choices must be worth the same, by
clingo's own optimum and by numpy's, or the run fails. The region of interest lies at the centre
of a block, since the paper measures from block to block. FRAS is measured with its default
criterion `capped` too. Each measurement has a process of its own; a baseline that does not
finish within the budget is said so, and what is larger is not tried.
"""

import argparse
import json
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.machine import machine
from benchmarks.planner_figure import criteria_table, draw, main_table, targets
from benchmarks.planner_jobs import (
    Raw,
    measure_baseline,
    measure_flatness,
    measure_floor,
    measure_memory,
    measure_planner,
    measure_reasons,
    percentile_ms,
)
from benchmarks.telling import target_lines, target_rows

SIZES = (5, 6, 7, 8, 9, 10, 20, 40)
CRITERIA = ("literal", "capped")
VARIANTS = ("fresh", "one")
OUT = Path("runs/bench")
BUDGET_S = 20.0
GIVE_UP_S = 600.0
REPEATS = 3
REPLANS = 10_000
VERIFIED_STEPS = 10_000


def in_process(job: Callable[..., Raw], *arguments: object, budget_s: float) -> Raw | None:
    """Run a job; None if it outlives its budget. What it raises ends the benchmark."""
    context = get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_serve, args=(sender, job, arguments))
    process.start()
    sender.close()
    answer: Any = "it did not start"
    try:
        for wait_s in (GIVE_UP_S, budget_s):  # one for `ready`, one for the answer
            if not receiver.poll(wait_s):
                process.terminate()
                return None
            answer = receiver.recv()
            if isinstance(answer, str):
                break
    except EOFError:
        answer = "its process died"
    finally:
        process.join()
    if isinstance(answer, str):
        raise SystemExit(f"{job.__name__}{arguments}: {answer}")
    return answer


def _serve(sender: Connection, job: Callable[..., Raw], arguments: tuple[object, ...]) -> None:
    try:
        sender.send(job(lambda: sender.send({}), *arguments))
    except Exception as error:  # noqa: BLE001 - the parent tells it and stops
        sender.send(f"{type(error).__name__}: {error}")


def _mean_ms(spent_s: list[float]) -> float:
    return round(float(np.mean(spent_s)) * 1e3, 3)


def _needed(job: Callable[..., Raw], *arguments: object) -> Raw:
    answer = in_process(job, *arguments, budget_s=GIVE_UP_S)
    if answer is None:
        raise SystemExit(f"{job.__name__}{arguments} took more than {GIVE_UP_S:.0f} s")
    return answer


def planner_figures(n: int, criterion: str, repeats: int) -> tuple[Raw, Raw]:
    """Return the summary of one size and criterion, and the raw answer behind it."""
    raw = _needed(measure_planner, n, criterion, repeats)
    memory = _needed(measure_memory, n, criterion)
    cells: dict[str, list[Raw]] = raw["cells"]
    runs = [run for cell in cells.values() for run in cell]
    mixed: list[tuple[float, float, float]] = raw["mixed"]
    warm_s, search_s, told_s = (list(column) for column in zip(*mixed, strict=True))
    plan_s = [whole - told for whole, told in zip(warm_s, told_s, strict=True)]
    summary = {
        "cold_ms": {c: _mean_ms([run["cold_s"] for run in rows]) for c, rows in cells.items()},
        "warm_ms": {
            c: percentile_ms([s for run in rows for s in run["warm_s"]], 50)
            for c, rows in cells.items()
        },
        "ground_ms": _mean_ms([run["ground_s"] for run in runs]),
        "solve_ms": _mean_ms([run["solve_s"] for run in runs]),
        "whole_ms": _mean_ms([run["cold_s"] for run in runs]),
        "models": max(run["models"] for run in runs),
        "warm_p50_ms": percentile_ms(warm_s, 50),
        "warm_p99_ms": percentile_ms(warm_s, 99),
        "warm_plan_p50_ms": percentile_ms(plan_s, 50),
        "warm_plan_p99_ms": percentile_ms(plan_s, 99),
        "warm_search_p50_ms": percentile_ms(search_s, 50),
        "told_p50_ms": percentile_ms(told_s, 50),
        "warm_calls": len(mixed),
        "numpy_ms": percentile_ms([run["numpy_s"] for run in runs], 50),
        "mib": round(memory["mib"], 1),
    }
    return summary, raw


def baseline_figures(n: int, variant: str, budget_s: float, ours: dict[str, list[Raw]]) -> Raw:
    """Return the means of the cells that finished, after checking each plan against ours."""
    found: dict[str, float | str] = {}
    mib: list[float] = []
    for cell, rows in ours.items():
        runs: list[Raw] = []
        for seed, own in enumerate(rows):
            run = in_process(measure_baseline, n, cell, seed, variant, budget_s=budget_s)
            if run is None:
                break
            if (run["actions"], run["score"]) != (own["actions"], own["score"]):
                raise SystemExit(
                    f"N = {n}, {cell}, seed {seed}: the baseline ({variant}) plans "
                    f"{run['actions']} worth {run['score']}, FRAS {own['actions']} worth "
                    f"{own['score']}"
                )
            runs.append(run)
        mib += [run["mib"] for run in runs]
        if len(runs) < len(rows):
            found[cell] = f"> {budget_s:g} s"
            break
        found[cell] = _mean_ms([run["s"] for run in runs])
    return {"ms": found, "mib": round(max(mib), 1) if mib else None}


def measure(sizes: list[int], budget_s: float, repeats: int) -> dict[int, Raw]:
    result: dict[int, Raw] = {}
    too_large: set[str] = set()
    for n in sizes:
        rows: Raw = {"baseline": {}}
        rows[CRITERIA[0]], raw = planner_figures(n, CRITERIA[0], repeats)
        rows[CRITERIA[1]], _ = planner_figures(n, CRITERIA[1], repeats)
        for variant in VARIANTS:
            if variant in too_large:
                continue
            rows["baseline"][variant] = baseline_figures(n, variant, budget_s, raw["cells"])
            if any(isinstance(ms, str) for ms in rows["baseline"][variant]["ms"].values()):
                too_large.add(variant)
        result[n] = rows
        print(f"N = {n} done", flush=True)
    return result


def main() -> None:
    parser = argparse.ArgumentParser(prog="fras bench planner", description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES, metavar="N")
    parser.add_argument(
        "--budget", type=float, default=BUDGET_S, help="seconds for a plan of the baseline"
    )
    parser.add_argument("--repeats", type=int, default=REPEATS, help="scenes for each cell")
    parser.add_argument(
        "--replans", type=int, default=REPLANS, help="warm plans while memory is watched"
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=OUT,
        help="folder for planner.json and planner.png (default: %(default)s)",
    )
    options = parser.parse_args()
    result = measure(sorted(options.sizes), options.budget, options.repeats)
    watched = 7 if 7 in result else min(result)
    flat = _needed(measure_flatness, watched, options.replans)
    flat["floor_mib"] = _needed(measure_floor, options.replans)["mib"]
    asked = 10 if 10 in result else max(result)
    reasons = _needed(measure_reasons, asked, VERIFIED_STEPS)
    reached = targets(result, flat, reasons, VARIANTS, CRITERIA)
    print(main_table(result, VARIANTS, CRITERIA[0]))
    print(criteria_table(result, CRITERIA))
    print(
        f"memory at N = {flat['n']}: {flat['before_mib']:.1f} MiB, {flat['growth_mib']:+.2f} MiB "
        f"after {flat['replans']:,} more plans, {flat['last_half_mib']:+.2f} MiB in the last half; "
        f"as many empty clingo.Control: {flat['floor_mib']:+.2f} MiB; "
        f"p50 {flat['first_p50_ms']} ms in their first tenth, {flat['last_p50_ms']} ms in the last"
    )
    print(
        f"at N = {asked}: why not {reasons['why_not_p50_ms']} ms "
        f"(p99 {reasons['why_not_p99_ms']}), "
        f"why no plan {reasons['core_p50_ms']} ms (p99 {reasons['core_p99_ms']}), "
        f"{VERIFIED_STEPS:,} steps verified in {reasons['verify_ms']} ms"
    )
    print(target_lines(reached))
    options.out.mkdir(parents=True, exist_ok=True)
    exponents = draw(result, VARIANTS, CRITERIA, options.out / "planner.png")
    report = {
        "machine": machine(),
        "setting": {"repeats": options.repeats, "budget_s": options.budget},
        "compared_by": CRITERIA[0],
        "sizes": result,
        "memory_over_replans": flat,
        "reasons": reasons,
        "growth_exponents": exponents,
        "targets": target_rows(reached),
    }
    (options.out / "planner.json").write_text(json.dumps(report, indent=2) + "\n")
    print(f"written: {options.out / 'planner.json'}, {options.out / 'planner.png'}")


if __name__ == "__main__":
    main()
