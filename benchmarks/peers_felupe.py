"""The task of `benchmarks.fe` in felupe, set up as its users would for speed.

What is the same: mesh, attached and led nodes, lift per tick, St Venant-Kirchhoff with the same
constants. What differs: each tick is a static equilibrium (felupe has no time integration in this
form: no inertia, no damping), there is no bed, and the element is the fully integrated hexahedron
(8 points; FRAS's default adds a ninth and integrates selectively). All of that is in its favour.
The material is written by hand with an analytic tangent, which is faster than felupe's automatic
differentiation; Newton's tolerance is 1e-3 of the reactions, like FRAS's 1 mN; the linear system
goes to SuperLU or to pypardiso, whichever was faster in a trial on this mesh. Where plain Newton
finds no equilibrium (a static solve has no inertia to lean on) the ticks before that count.
"""

# felupe ships no types.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportMissingTypeStubs=false
# pyright: reportAttributeAccessIssue=false, reportMissingImports=false

import importlib.metadata
import importlib.util
import time
from typing import Any

import felupe
import numpy as np
from benchmarks.fe_task import LIFT_PER_TICK_M, TICKS, Measured, Task

from fras_sim.fem.parameters import TissueParameters

TOLERANCE = 1e-3
IDENTITY = np.eye(3)


def measure(task: Task, budget_s: float) -> Measured:
    """Pull until the end or until the budget is spent."""
    solvers: dict[str, Any] = {"SuperLU": None}
    if importlib.util.find_spec("pypardiso"):
        import pypardiso

        solvers["pypardiso"] = pypardiso.spsolve
    trials = {
        name: float(np.mean(_pull(task, solver, 3, budget_s / 4).tick_ms[1:] or [np.inf]))
        for name, solver in solvers.items()
    }
    name = min(trials, key=lambda solver: trials[solver])
    result = _pull(task, solvers[name], TICKS, budget_s)
    result.notes |= {"solver": name, "version": importlib.metadata.version("felupe")}
    return result


def _pull(task: Task, solver: Any, ticks: int, budget_s: float) -> Measured:
    nodes = np.arange(len(task.mesh.nodes_m))
    mesh = felupe.Mesh(task.mesh.nodes_m, task.mesh.elements, "hexahedron")
    field = felupe.FieldContainer([felupe.Field(felupe.RegionHexahedron(mesh), dim=3)])
    body = felupe.SolidBody(_material(task.parameters), field)
    is_fixed, is_held = np.isin(nodes, task.fixed), np.isin(nodes, task.held)
    bounds = {
        "fixed": felupe.Boundary(field[0], mask=is_fixed),
        "sideways": felupe.Boundary(field[0], mask=is_held, skip=(0, 0, 1)),
        "up": felupe.Boundary(field[0], mask=is_held, skip=(1, 1, 0)),
    }
    known, unknown = felupe.dof.partition(field, bounds)
    options: dict[str, Any] = {} if solver is None else {"solver": solver}
    result = Measured()
    iterations = 0
    began_s = time.perf_counter()
    for tick in range(1, ticks + 1):
        bounds["up"].update(tick * LIFT_PER_TICK_M)
        try:
            with result.tick():
                prescribed = felupe.dof.apply(field, bounds, known)
                solution = felupe.newtonraphson(
                    items=[body],
                    dof0=known,
                    dof1=unknown,
                    ext0=prescribed,
                    tol=TOLERANCE,
                    verbose=0,
                    **options,
                )
        except felupe.tools.NewtonConvergenceError:
            result.notes["no_equilibrium_in_tick"] = tick
            break
        iterations += solution.iterations
        if time.perf_counter() - began_s > budget_s:
            break
    result.notes["iterations"] = round(iterations / max(len(result.tick_ms), 1), 2)
    return result


def _material(parameters: TissueParameters) -> Any:
    young, nu = parameters.young_modulus_pa, parameters.poisson_ratio
    mu, lam = young / (2 * (1 + nu)), young * nu / ((1 + nu) * (1 - 2 * nu))

    def second_piola(F: Any) -> Any:
        E = 0.5 * (np.einsum("kI...,kJ...->IJ...", F, F) - IDENTITY[:, :, None, None])
        return 2 * mu * E + lam * np.einsum("KK...->...", E) * IDENTITY[:, :, None, None]

    def stress(x: Any) -> list[Any]:
        return [np.einsum("iK...,KJ...->iJ...", x[0], second_piola(x[0])), None]

    def elasticity(x: Any) -> list[Any]:
        F = x[0]
        tangent = np.einsum("ik,JL...->iJkL...", IDENTITY, second_piola(F))
        tangent += lam * np.einsum("iJ...,kL...->iJkL...", F, F)
        tangent += mu * np.einsum("iL...,kJ...->iJkL...", F, F)
        left = np.einsum("iK...,kK...->ik...", F, F)
        tangent += mu * np.einsum("ik...,JL->iJkL...", left, IDENTITY)
        return [tangent]

    return felupe.Material(stress, elasticity)
