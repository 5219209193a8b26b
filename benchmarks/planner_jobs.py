"""What `benchmarks.planner` measures, each piece to be run in a process of its own.

A job says `ready` when its budget starts. All plan in the same scenes: attachments in three
patches, the region of interest under the centre of a block.
"""

import gc
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import clingo
import numpy as np
from benchmarks import planner_baseline as baseline
from benchmarks.memory import memory_mib
from benchmarks.planner_figure import CELLS

from fras_planner.knowledge import load_knowledge
from fras_planner.planning import Knowledge, Plan, Planner, PlanningScene, verify

MIXED_CALLS = 200
# At and above this size, fewer calls.
LARGE = 20
MIXED_CALLS_LARGE = 60
CELL_CALLS = 12
SETTLE = 500
REASONS = 120
PATCHES = 3
SIZE_M = (0.1, 0.12)
Raw = dict[str, Any]
Ready = Callable[[], None]


def percentile_ms(spent_s: list[float], share: float) -> float:
    return round(float(np.percentile(spent_s, share)) * 1e3, 3)


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


def _ask(planner: Planner, kind: str, rng: np.random.Generator) -> tuple[float, float, float]:
    """Plan in a random state: seconds of the whole call, and of the search and telling in it."""
    state = make_state(kind, planner.scene, rng)
    began_s = time.perf_counter()
    plan = planner.plan(state.fluents, tried=state.tried)
    spent_s = time.perf_counter() - began_s
    if not plan.actions or not plan.optimal:
        raise RuntimeError(f"no best plan for {state}")
    return spent_s, plan.solve_s, plan.told_s


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
        "first_p50_ms": percentile_ms(spent_s[SETTLE : SETTLE + tenth], 50),
        "last_p50_ms": percentile_ms(spent_s[-tenth:], 50),
    }


def measure_floor(ready: Ready, controls: int) -> Raw:
    """How far as many empty Controls raise it: clingo itself gives a little less back each time."""
    ready()
    used_mib: list[float] = []
    for number in range(SETTLE + controls + 1):
        if number in (SETTLE, SETTLE + controls):
            gc.collect()
            used_mib.append(memory_mib("VmRSS"))
        clingo.Control([])
    return {"mib": used_mib[1] - used_mib[0]}


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
        "why_not_p50_ms": percentile_ms(why_not_s, 50),
        "why_not_p99_ms": percentile_ms(why_not_s, 99),
        "core_p50_ms": percentile_ms(core_s, 50),
        "core_p99_ms": percentile_ms(core_s, 99),
        "verified_steps": steps,
        "verify_ms": round(1e3 * (time.perf_counter() - began_s), 1),
    }
