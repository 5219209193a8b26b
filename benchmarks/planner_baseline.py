"""What FRAS's planner is held against: the paper's way with clingo, and numpy.

The paper's way is written from its text (`planner_baseline.lp`): clingo grounds the distances of
all pairs of blocks at each step, and steps are added until there is a plan. Two ways to do so:
`fresh` takes a new Control for each number of steps; `one` takes a new Control for each plan and
grounds one step more into it, as a published program of the paper's authors does for another task.
What does not depend on clingo, the text of the facts and the distances, is made before the clock
starts. numpy finds the best block only: no plan, no reasons.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import clingo
import numpy as np
from numpy.typing import NDArray

from fras_planner.planning import PlanningScene
from fras_planner.planning.measures import whole_mm

PROGRAM = Path(__file__).with_suffix(".lp")
MAX_STEPS = 6
ENOUGH_MM = 25
"""From where on distance from an attachment counts no more, as in `asp/preferences/capped.lp`."""
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class BaselinePlan:
    """The names of a plan's actions, and what its target is worth; None without a new grasp."""

    actions: tuple[str, ...]
    score: int | None


@dataclass(frozen=True, eq=False)
class Geometry:
    """A scene as arrays: blocks and region of interest [m], which blocks are fixed."""

    names: tuple[str, ...]
    blocks_m: Floats
    roi_m: Floats
    fixed: NDArray[np.bool_]

    @classmethod
    def of(cls, scene: PlanningScene) -> "Geometry":
        fixed = [f"fixed({name})" in scene.statics for name in scene.names]
        return cls(scene.names, np.array(scene.blocks_m), np.array(scene.roi_m), np.array(fixed))


def _apart_mm(blocks_m: Floats, others_m: Floats) -> Ints:
    return whole_mm(np.linalg.norm(blocks_m[:, None] - others_m[None], axis=2))


def _roi_mm(geometry: Geometry) -> Ints:
    return whole_mm(np.linalg.norm(geometry.blocks_m[:, :2] - geometry.roi_m[:2], axis=1))


def literal(geometry: Geometry) -> Ints:
    """Score of each block as the paper prints it, equal distances counted once."""
    apart = _apart_mm(geometry.blocks_m, geometry.blocks_m[geometry.fixed])
    present = np.zeros((len(apart), int(apart.max()) + 1))
    np.put_along_axis(present, apart, 1.0, axis=1)
    sums = (present @ np.arange(present.shape[1])).astype(np.int64)
    return sums - _roi_mm(geometry)


def capped(geometry: Geometry) -> Ints:
    """Score of each block by the planner's default."""
    apart = _apart_mm(geometry.blocks_m, geometry.blocks_m[geometry.fixed])
    return 2 * np.minimum(apart.min(axis=1), ENOUGH_MM) - _roi_mm(geometry)


SCORES: dict[str, Callable[[Geometry], Ints]] = {"literal": literal, "capped": capped}


def best_block(geometry: Geometry, criterion: str) -> int:
    """Row of the best block that is not fixed."""
    scores = SCORES[criterion](geometry)
    return int(np.where(geometry.fixed, np.iinfo(np.int64).min, scores).argmax())


def facts(scene: PlanningScene) -> str:
    """Return blocks and the distances of all pairs of them as text."""
    blocks_m = np.array(scene.blocks_m)
    lines = [f"block({name})." for name in scene.names]
    for name, row in zip(scene.names, _apart_mm(blocks_m, blocks_m).tolist(), strict=True):
        lines += [f"distance({name},{o},{x})." for o, x in zip(scene.names, row, strict=True)]
    return "\n".join(lines)


def plan(text: str, fluents: Iterable[str], *, fresh: bool) -> BaselinePlan:
    """Add steps until there is a plan, and take the best one of that length."""
    sensed = [clingo.parse_term(fluent) for fluent in fluents]
    control: clingo.Control | None = None
    for last in range(1, MAX_STEPS + 1):
        if control is None or fresh:
            control = _start(text, sensed)
            steps = range(1, last + 1)
        else:
            control.release_external(_query(last - 1))
            steps = range(last, last + 1)
        parts = [("step", [clingo.Number(t)]) for t in steps]
        control.ground([*parts, ("check", [clingo.Number(last)])])
        control.assign_external(_query(last), True)
        found = _solve(control)
        if found is not None:
            return found
    raise RuntimeError(f"the baseline found no plan of {MAX_STEPS - 1} actions")


def _start(text: str, sensed: list[clingo.Symbol]) -> clingo.Control:
    # clingo only tells that some atoms are in no head: those of step 0.
    control = clingo.Control([], logger=lambda _code, _message: None)
    control.add("base", [], PROGRAM.read_text(encoding="utf-8"))
    control.add("base", [], text)
    control.ground([("base", [])])
    for symbol in sensed:
        control.assign_external(symbol, True)
    return control


def _query(step: int) -> clingo.Symbol:
    return clingo.Function("query", [clingo.Number(step)])


def _solve(control: clingo.Control) -> BaselinePlan | None:
    best: BaselinePlan | None = None
    with control.solve(yield_=True) as models:
        for model in models:
            atoms = sorted(model.symbols(shown=True), key=lambda atom: atom.arguments[-1].number)
            actions = tuple(atom.name for atom in atoms)
            best = BaselinePlan(actions, -model.cost[0] if "reach" in actions else None)
    return best
