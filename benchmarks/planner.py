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
criterion `weighted` too. Each measurement has a process of its own; a baseline that does not
finish within the budget is said so, and what is larger is not tried.
"""

import argparse
import gc
import json
import os
import platform
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks import planner_baseline as baseline
from benchmarks.memory import memory_mib
from benchmarks.planner_figure import CELLS, criteria_table, draw, main_table, targets

from fras_planner.knowledge import load_knowledge
from fras_planner.planning import Knowledge, Plan, Planner, PlanningScene, verify

SIZES = (5, 6, 7, 8, 9, 10, 20, 40)
CRITERIA = ("literal", "weighted")
VARIANTS = ("fresh", "one")
OUT = Path("runs/bench")
BUDGET_S = 20.0
GIVE_UP_S = 600.0
REPEATS = 3
MIXED_CALLS = 200
# At and above this size, fewer calls.
LARGE = 20
MIXED_CALLS_LARGE = 60
CELL_CALLS = 12
REPLANS = 10_000
SETTLE = 500
REASONS = 120
VERIFIED_STEPS = 10_000
PATCHES = 3
SIZE_M = (0.1, 0.12)
Raw = dict[str, Any]
Ready = Callable[[], None]


@dataclass(frozen=True)
class State:
    """What is sensed, and which blocks were tried in vain."""

    fluents: list[str]
    tried: list[str]


def make_scene(n: int, cell: str, seed: int) -> PlanningScene:
    """Attach that share of the blocks, nearest to three random points; the ROI under another."""
    percent = int(cell[2:].rstrip("%"))
    rng = np.random.default_rng([n, percent, seed])
    names = [f"b({i},{j})" for i in range(1, n + 1) for j in range(1, n + 1)]
    cells = np.array([(i, j) for i in range(n) for j in range(n)])
    blocks = np.column_stack([(cells + 0.5) * np.array(SIZE_M) / n, np.full(n * n, 0.005)])
    patches = rng.uniform([0, 0], SIZE_M, size=(PATCHES, 2))
    away = np.linalg.norm(blocks[:, None, :2] - patches, axis=2).min(axis=1)
    fixed, free = np.split(np.argsort(away), [max(1, round(n * n * percent / 100))])
    over = int(rng.choice(free))
    statics = [f"fixed({names[row]})" for row in fixed] + [f"above_roi({names[over]})"]
    for name, (_, y, _) in zip(names, blocks, strict=True):
        statics.append(f"reachable(psm{1 if y < SIZE_M[1] / 2 - 1e-9 else 2},{name})")
    return PlanningScene.make(names, blocks, [*blocks[over, :2], 0.0], statics)


def make_state(kind: str, scene: PlanningScene, rng: np.random.Generator) -> State:
    """A: tools somewhere; B: free tissue in hand at the limit; C: attached tissue."""
    if kind == "A":
        return State([f"at(psm{arm},{rng.choice(scene.names)})" for arm in (1, 2)], [])
    fixed = [name for name in scene.names if f"fixed({name})" in scene.statics]
    free = [name for name in scene.names if name not in fixed]
    block = str(rng.choice(free if kind == "B" else fixed))
    arm = next(arm for arm in ("psm1", "psm2") if f"reachable({arm},{block})" in scene.statics)
    held = [f"at({arm},{block})", f"in_hand({arm},{block})", f"closed_gripper({arm})"]
    return State([*held, f"max_height({arm})"], [block] if kind == "C" else [])


def first_state(cell: str, scene: PlanningScene, seed: int) -> State:
    """The state that all methods plan for first."""
    kind = cell[0]
    return State([], []) if kind == "A" else make_state(kind, scene, np.random.default_rng(seed))


# Jobs: each runs in a process of its own, and says when its budget starts.


def measure_baseline(ready: Ready, n: int, cell: str, seed: int, variant: str) -> Raw:
    scene = make_scene(n, cell, seed)
    text = baseline.facts(scene)
    fluents = [*scene.statics, *first_state(cell, scene, seed).fluents]
    baseline.plan("block(b(1,1)).", ["visible_roi"], fresh=True)  # so that clingo is loaded
    before_mib = memory_mib("VmRSS")
    ready()
    began_s = time.perf_counter()
    plan = baseline.plan(text, fluents, fresh=variant == "fresh")
    spent_s = time.perf_counter() - began_s
    grown_mib = memory_mib("VmHWM") - before_mib
    return {"s": spent_s, "actions": plan.actions, "score": plan.score, "mib": grown_mib}


def measure_planner(ready: Ready, n: int, criterion: str, repeats: int) -> Raw:
    knowledge = load_knowledge()
    ready()
    cells = {
        cell: [_measure_cell(knowledge, n, cell, seed, criterion) for seed in range(repeats)]
        for cell in CELLS
    }
    planner = Planner(knowledge, make_scene(n, CELLS[-1], 0), criterion, clock=time.perf_counter)
    rng = np.random.default_rng(n)
    calls = MIXED_CALLS if n < LARGE else MIXED_CALLS_LARGE
    planner.plan([])
    return {"cells": cells, "mixed": [_ask(planner, "ABC"[i % 3], rng) for i in range(calls)]}


def _measure_cell(knowledge: Knowledge, n: int, cell: str, seed: int, criterion: str) -> Raw:
    scene = make_scene(n, cell, seed)
    state = first_state(cell, scene, seed)
    began_s = time.perf_counter()
    planner = Planner(knowledge, scene, criterion, clock=time.perf_counter)
    plan = planner.plan(state.fluents, tried=state.tried)
    cold_s = time.perf_counter() - began_s
    rng = np.random.default_rng([n, seed])
    warm_s = [_ask(planner, cell[0], rng)[0] for _ in range(CELL_CALLS)]
    geometry = baseline.Geometry.of(scene)
    began_s = time.perf_counter()
    best = baseline.best_block(geometry, criterion)
    numpy_s = time.perf_counter() - began_s
    scores = baseline.SCORES[criterion](geometry).tolist()
    score = _score(plan, scene, scores)
    if score not in (None, scores[best]):
        raise RuntimeError(
            f"N = {n}, {cell}, seed {seed}, {criterion}: FRAS grasps {plan.target}, worth "
            f"{score}; numpy finds {scene.names[best]}, worth {scores[best]}"
        )
    return {
        "cold_s": cold_s,
        "ground_s": plan.ground_s,
        "solve_s": plan.solve_s,
        "warm_s": warm_s,
        "numpy_s": numpy_s,
        "actions": tuple(action.name for action in plan.actions),
        "score": score,
        "models": plan.models,
    }


def _ask(planner: Planner, kind: str, rng: np.random.Generator) -> tuple[float, float]:
    """Plan in a random state: seconds of the whole call, and of the search in it."""
    state = make_state(kind, planner.scene, rng)
    began_s = time.perf_counter()
    plan = planner.plan(state.fluents, tried=state.tried)
    spent_s = time.perf_counter() - began_s
    if not plan.actions or not plan.optimal:
        raise RuntimeError(f"no best plan for {state}")
    return spent_s, plan.solve_s


def _score(plan: Plan, scene: PlanningScene, scores: list[int]) -> int | None:
    if not plan.actions:
        raise RuntimeError("FRAS found no plan")
    return scores[scene.names.index(plan.target)] if plan.target else None


def measure_memory(ready: Ready, n: int, criterion: str) -> Raw:
    """How far a Planner and a few plans raise the process's peak."""
    knowledge, scene = load_knowledge(), make_scene(n, CELLS[-1], 0)
    ready()
    before_mib = memory_mib("VmRSS")
    planner, rng = Planner(knowledge, scene, criterion), np.random.default_rng(n)
    for number in range(12):
        _ask(planner, "ABC"[number % 3], rng)
    return {"mib": memory_mib("VmHWM") - before_mib}


def measure_flatness(ready: Ready, n: int, replans: int) -> Raw:
    """How far many plans of one Planner raise the process's memory, after some to settle."""
    planner, rng = Planner(load_knowledge(), make_scene(n, CELLS[-1], 0)), np.random.default_rng(n)
    ready()
    spent_s: list[float] = []
    used_mib: list[float] = []
    for number in range(SETTLE + replans + 1):
        if number in (SETTLE, SETTLE + replans // 2, SETTLE + replans):
            gc.collect()  # what waits for the collector is no leak
            used_mib.append(memory_mib("VmRSS"))
        spent_s.append(_ask(planner, "ABC"[number % 3], rng)[0])
    before_mib, halfway_mib, after_mib = used_mib
    tenth = max(1, replans // 10)
    return {
        "n": n,
        "replans": replans,
        "before_mib": before_mib,
        "growth_mib": after_mib - before_mib,
        "last_half_mib": after_mib - halfway_mib,
        "first_p50_ms": _percentile_ms(spent_s[SETTLE : SETTLE + tenth], 50),
        "last_p50_ms": _percentile_ms(spent_s[-tenth:], 50),
    }


def measure_reasons(ready: Ready, n: int, steps: int) -> Raw:
    """How long it takes to say why not, why there is no plan, and whether a history is sound."""
    knowledge, scene = load_knowledge(), make_scene(n, CELLS[-1], 0)
    planner, rng = Planner(knowledge, scene), np.random.default_rng(n)
    ready()
    why_not_s: list[float] = []
    core_s: list[float] = []
    for number in range(REASONS):
        state = make_state("ABC"[number % 3], scene, rng)
        block = str(rng.choice(scene.names))
        actions = (f"reach(psm1,{block})", f"pull(psm1,{block})", "release(psm2)", block)
        began_s = time.perf_counter()
        planner.why_not(actions[number % 4], state.fluents, tried=state.tried)
        why_not_s.append(time.perf_counter() - began_s)
        began_s = time.perf_counter()
        plan = planner.plan(state.fluents, tried=scene.names)
        core_s.append(time.perf_counter() - began_s)
        if number % 3 != 1 and plan.no_plan is None:
            raise RuntimeError("a plan where every block was tried")
    history = planner.plan([]).history
    rounds = {t: history[1 + (t - 1) % len(history)] for t in range(1, steps + 1)}
    began_s = time.perf_counter()
    verify(knowledge, rounds)
    return {
        "n": n,
        "why_not_p50_ms": _percentile_ms(why_not_s, 50),
        "why_not_p99_ms": _percentile_ms(why_not_s, 99),
        "core_p50_ms": _percentile_ms(core_s, 50),
        "core_p99_ms": _percentile_ms(core_s, 99),
        "verified_steps": steps,
        "verify_ms": round(1e3 * (time.perf_counter() - began_s), 1),
    }


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


def _percentile_ms(spent_s: list[float], share: float) -> float:
    return round(float(np.percentile(spent_s, share)) * 1e3, 3)


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
    mixed: list[tuple[float, float]] = raw["mixed"]
    warm_s = [whole_s for whole_s, _ in mixed]
    summary = {
        "cold_ms": {c: _mean_ms([run["cold_s"] for run in rows]) for c, rows in cells.items()},
        "warm_ms": {
            c: _percentile_ms([s for run in rows for s in run["warm_s"]], 50)
            for c, rows in cells.items()
        },
        "ground_ms": _mean_ms([run["ground_s"] for run in runs]),
        "solve_ms": _mean_ms([run["solve_s"] for run in runs]),
        "whole_ms": _mean_ms([run["cold_s"] for run in runs]),
        "models": max(run["models"] for run in runs),
        "warm_p50_ms": _percentile_ms(warm_s, 50),
        "warm_p99_ms": _percentile_ms(warm_s, 99),
        "warm_search_p50_ms": _percentile_ms([search_s for _, search_s in mixed], 50),
        "warm_search_p99_ms": _percentile_ms([search_s for _, search_s in mixed], 99),
        "told_p50_ms": _percentile_ms([whole_s - search_s for whole_s, search_s in mixed], 50),
        "warm_calls": len(mixed),
        "numpy_ms": _percentile_ms([run["numpy_s"] for run in runs], 50),
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


def _processor() -> str:
    try:
        found = re.search(r"model name\s*:\s*(.+)", Path("/proc/cpuinfo").read_text())
    except OSError:
        found = None
    return found[1] if found else platform.processor()


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
    asked = 10 if 10 in result else max(result)
    reasons = _needed(measure_reasons, asked, VERIFIED_STEPS)
    reached = targets(result, flat, reasons, VARIANTS, CRITERIA)
    print(main_table(result, VARIANTS, CRITERIA[0]))
    print(criteria_table(result, CRITERIA))
    print(
        f"memory at N = {flat['n']}: {flat['before_mib']:.1f} MiB, {flat['growth_mib']:+.2f} MiB "
        f"after {flat['replans']:,} more plans, {flat['last_half_mib']:+.2f} MiB in the last half; "
        f"p50 {flat['first_p50_ms']} ms in their first tenth, {flat['last_p50_ms']} ms in the last"
    )
    print(
        f"at N = {asked}: why not {reasons['why_not_p50_ms']} ms "
        f"(p99 {reasons['why_not_p99_ms']}), "
        f"why no plan {reasons['core_p50_ms']} ms (p99 {reasons['core_p99_ms']}), "
        f"{VERIFIED_STEPS:,} steps verified in {reasons['verify_ms']} ms"
    )
    for text, value, enough in reached:
        print(f"{'met' if enough else 'MISSED':8}{value:>14}  {text}")
    options.out.mkdir(parents=True, exist_ok=True)
    exponents = draw(result, VARIANTS, CRITERIA, options.out / "planner.png")
    report = {
        "machine": {"processor": _processor(), "cores": os.cpu_count()},
        "setting": {"repeats": options.repeats, "budget_s": options.budget},
        "compared_by": CRITERIA[0],
        "sizes": result,
        "memory_over_replans": flat,
        "reasons": reasons,
        "growth_exponents": exponents,
        "targets": [{"what": t, "value": v, "met": enough} for t, v, enough in reached],
    }
    (options.out / "planner.json").write_text(json.dumps(report, indent=2) + "\n")
    print(f"written: {options.out / 'planner.json'}, {options.out / 'planner.png'}")


if __name__ == "__main__":
    main()
