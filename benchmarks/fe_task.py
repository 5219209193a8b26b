"""The task of `benchmarks.fe`: one pull on one tissue, and how FRAS does it."""

import gc
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem import Mesh, TissueParameters, TissueSimulator, ToolInput, box_mesh
from fras_sim.fem.assembly import ElasticBody
from fras_sim.fem.grasp import nodes_in_reach
from fras_sim.fem.linear_solver import SOLVERS, LinearSolver, linear_solver
from fras_sim.fem.pattern import SparsityPattern

DT_S = 0.02
LIFT_M = 0.05
LIFT_PER_TICK_M = 0.02 * DT_S
TICKS = round(LIFT_M / LIFT_PER_TICK_M)
# 40 % of the bottom is attached, and the tool grasps the block farthest from that: the scene whose
# largest nodal force, 0.40 N at 21x25x2, is next to the median of 30 (0.43 N, design section 5).
DISCS_M = (
    (0.0805, 0.0970, 0.0303),
    (0.0286, 0.0065, 0.0277),
    (0.0408, 0.0054, 0.0210),
    (0.0999, 0.0783, 0.0247),
    (0.0435, 0.1169, 0.0200),
)
TIP_M = (0.1 / 14, 0.12 * 9 / 14, 0.005)
OPEN_RAD, CLOSED_RAD = 1.0, -0.3

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Task:
    """A mesh, the nodes that are attached, and those that go up by 0.4 mm in each of 125 ticks."""

    mesh: Mesh
    fixed: Ints
    held: Ints
    parameters: TissueParameters


@dataclass
class Measured:
    """What one method needed for each tick, by the clock and of the processor, and notes."""

    tick_ms: list[float] = field(default_factory=list[float])
    cpu_ms: list[float] = field(default_factory=list[float])
    phase_ms: dict[str, float] = field(default_factory=dict[str, float])
    notes: dict[str, Any] = field(default_factory=dict[str, Any])

    @contextmanager
    def tick(self) -> Generator[None]:
        """Measure one tick."""
        wall_s, cpu_s = time.perf_counter(), time.process_time()
        yield
        self.cpu_ms.append(1e3 * (time.process_time() - cpu_s))
        self.tick_ms.append(1e3 * (time.perf_counter() - wall_s))


def make_task(counts: tuple[int, int, int]) -> Task:
    mesh = box_mesh(node_counts=counts)
    bottom = mesh.nodes_m[mesh.bottom_nodes]
    inside = [np.hypot(bottom[:, 0] - x, bottom[:, 1] - y) <= r for x, y, r in DISCS_M]
    fixed = mesh.bottom_nodes[np.any(inside, axis=0)]
    free = np.ones(len(mesh.nodes_m), dtype=bool)
    free[fixed] = False
    held = nodes_in_reach(mesh.nodes_m, np.array(TIP_M), free, mesh.spacing_m)
    return Task(mesh, fixed, held, TissueParameters(dt_s=DT_S))


class Stopwatch:
    """Adds up the time that calls take, by name."""

    def __init__(self) -> None:
        self.spent_s: dict[str, float] = {}
        self.calls: dict[str, int] = {}
        self.factor_bytes = 0

    def timed(self, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        self.spent_s[name], self.calls[name] = 0.0, 0

        def wrapped(*args: Any, **kwargs: Any) -> Any:
            began_s = time.perf_counter()
            try:
                return call(*args, **kwargs)
            finally:
                self.spent_s[name] += time.perf_counter() - began_s
                self.calls[name] += 1

        return wrapped

    def clear(self) -> None:
        for name in self.calls:
            self.spent_s[name], self.calls[name] = 0.0, 0


class TimedSolver:
    """A linear solver under a stopwatch."""

    def __init__(self, solver: LinearSolver, watch: Stopwatch) -> None:
        self.name = solver.name
        watch.factor_bytes = self.factor_bytes = solver.factor_bytes
        self.factorize = watch.timed("factor", solver.factorize)
        self.solve = watch.timed("solve", solver.solve)


@contextmanager
def timed_phases(solver: str, watch: Stopwatch) -> Generator[str]:
    """Put the linear solver and the element loops under a stopwatch; the solver's name for that."""

    def make(pattern: SparsityPattern) -> LinearSolver:
        return TimedSolver(linear_solver(solver, pattern), watch)

    loops = {"energy_gradient": "energy, gradient", "hessian": "Hessian", "strain": "strain"}
    original: dict[str, Any] = {name: getattr(ElasticBody, name) for name in loops}
    for name, phase in loops.items():
        setattr(ElasticBody, name, watch.timed(phase, original[name]))
    SOLVERS["timed"] = make
    try:
        yield "timed"
    finally:
        del SOLVERS["timed"]
        for name, call in original.items():
            setattr(ElasticBody, name, call)


def measure_fras(task: Task, solver: str, budget_s: float) -> Measured:
    """Pull with FRAS; `budget_s` is for the peers, FRAS does the whole pull."""
    watch = Stopwatch()
    result = Measured()
    tip_m = np.array(TIP_M)
    iterations: list[int] = []
    refactored = 0
    with timed_phases(solver, watch) as timed:
        tissue = TissueSimulator(task.mesh, task.parameters, task.fixed, solver=timed)
        tissue.measure({"psm1": ToolInput(tip_m, OPEN_RAD)})
        step = tissue.step({"psm1": ToolInput(tip_m, CLOSED_RAD)})
        if not np.array_equal(step.grasped["psm1"], task.held):
            raise RuntimeError("FRAS grasped other nodes than the task says")
        watch.clear()
        gc.collect()
        for tick in range(1, TICKS + 1):
            at_m = tip_m + np.array([0.0, 0.0, tick * LIFT_PER_TICK_M])
            with result.tick():
                step = tissue.step({"psm1": ToolInput(at_m, CLOSED_RAD)})
            if not step.solver.converged:
                raise RuntimeError(f"tick {tick} did not converge")
            iterations.append(step.solver.iterations)
            refactored += step.solver.refactored
    factor_bytes = watch.factor_bytes
    result.phase_ms = {name: 1e3 * spent / TICKS for name, spent in watch.spent_s.items()}
    result.phase_ms["other"] = float(np.mean(result.tick_ms)) - sum(result.phase_ms.values())
    result.notes = {
        "solver": tissue.solver_name,
        "iterations": round(float(np.mean(iterations)), 2),
        "steps_refactored": refactored,
        "calls": watch.calls,
        "factor_mib": round(factor_bytes / 2**20, 1),
        # A substitution reads the factor twice.
        "solve_gb_s": round(2e-9 * factor_bytes * watch.calls["solve"] / watch.spent_s["solve"], 1),
        "max_force_n": round(step.max_force_n, 3),
    }
    return result
