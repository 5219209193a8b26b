"""Equilibrium of a body under prescribed displacements, solved to rounding."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fras_sim.fem import kernels
from fras_sim.fem.assembly import ElasticBody
from fras_sim.fem.element import CELL_OF, ElementKind
from fras_sim.fem.errors import BadParameter, FactorizationFailed, NotConverged
from fras_sim.fem.kernels import largest
from fras_sim.fem.linear_solver import LinearSolver, linear_solver
from fras_sim.fem.materials import MaterialName
from fras_sim.fem.mesh import make_mesh
from fras_sim.fem.pattern import IdentityRows

ARMIJO = 1e-4
MAX_HALVINGS = 12
MAX_ITERATIONS = 40
# The smallest share of the load that one increment is cut to.
MIN_INCREMENT = 1.0 / 1024.0

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StaticResult:
    """An equilibrium.

    Parameters
    ----------
    displacement_m : ndarray, shape (n_nodes, 3), float64 [m]
    nodal_force_n : ndarray, shape (n_nodes, 3), float64 [N]
        dW/dx of each node: zero, up to the residual, where nothing is prescribed; elsewhere the
        force that the support exerts on the body.
    iterations : int
        Newton corrections, those of rejected load increments included.
    residual : float
        Largest force component out of balance at a free node [N].
    """

    displacement_m: Array
    nodal_force_n: Array
    iterations: int
    residual: float


def solve_static(
    nodes: ArrayLike,
    elements: ArrayLike,
    *,
    element: ElementKind,
    young_modulus_pa: float,
    poisson_ratio: float,
    fixed: ArrayLike,
    prescribed: Mapping[int, Sequence[float]],
    material: MaterialName = "svk",
    tol: float = 1e-10,
    solver: str = "scipy",
) -> StaticResult:
    """Return the equilibrium of a body that is held at some nodes and displaced at others.

    Parameters
    ----------
    nodes : array_like, shape (n_nodes, 3) [m]
    elements : array_like of int, shape (n_elements, nodes per element)
        In the order of VTK.
    element : {"hex8", "hex8-sri", "tet4", "tet10"}
    young_modulus_pa, poisson_ratio : float
    fixed : array_like of int
        Nodes that don't move.
    prescribed : mapping of int to (ux, uy, uz) [m]
        Displacements of other nodes. Together with `fixed` at least three nodes off one line.
    material : {"svk", "neo-hookean"}
    tol : float
        The largest force out of balance, as a share of the largest nodal force.
    solver : str
        Name of a linear solver (`linear_solver`), in double precision.

    Raises
    ------
    BadMesh, BadParameter
        What can't be computed, by name.
    NotConverged
        If no equilibrium was found, however small the increments of load.

    Notes
    -----
    Newton's method on the energy with the exact tangent where that is positive definite, else its
    projection, a line search on the energy, and increments of load that are halved when it fails.
    The result is a stable equilibrium: of several the one that the path of load leads to.
    """
    if element not in CELL_OF:
        raise BadParameter("element", element, "one of " + ", ".join(CELL_OF))
    if not 0.0 < tol < 1.0:
        raise BadParameter("tol", tol, "a number between 0 and 1")
    mesh = make_mesh(nodes, elements, CELL_OF[element])
    held, displacement = _checked_supports(mesh.nodes_m, fixed, prescribed)
    fixed_nodes = np.setdiff1d(np.asarray(fixed, dtype=np.int64), held).astype(np.int32)
    body = ElasticBody(mesh, young_modulus_pa, poisson_ratio, element, fixed_nodes, material)
    newton = _Newton(body, linear_solver(solver, body.pattern), held, tol)
    x = mesh.nodes_m.copy()
    load, increment = 0.0, 1.0
    while load < 1.0:
        goal = min(load + increment, 1.0)
        try:
            x = newton.solve(x, mesh.nodes_m[held] + goal * displacement)
            load, increment = goal, 2.0 * increment
        except (FactorizationFailed, _NoProgress):
            increment *= 0.5
            if increment < MIN_INCREMENT:
                raise NotConverged(
                    f"no equilibrium found beyond {100.0 * load:.1f} % of the displacements "
                    f"(residual {newton.residual_n:.3g} N): prescribe less, or refine the mesh; "
                    "fewer than three supported nodes, or all on one line, leave the body loose",
                    load=load,
                    residual=newton.residual_n,
                    iterations=newton.iterations,
                ) from None
    force = np.zeros_like(x)
    body.energy_gradient(x, force)
    return StaticResult(x - mesh.nodes_m, force, newton.iterations, newton.residual_n)


class _NoProgress(Exception):
    """The line search found nothing lower, or the iterations ran out."""


class _Newton:
    def __init__(
        self, body: ElasticBody, solver: LinearSolver, held: NDArray[np.int32], tol: float
    ) -> None:
        self.iterations = 0
        self.residual_n = 0.0
        self._body = body
        self._solver = solver
        self._held = held
        self._held_rows = body.pattern.row_of[held].ravel()
        self._led = IdentityRows(body.pattern, self._held_rows)
        self._tol = tol
        # Forces of a body at rest are rounding: a share of these is nothing.
        lengths_m = np.ptp(body.mesh.nodes_m, axis=0)
        self._rounding_n = 1e-14 * float(np.abs(body.hessian(body.mesh.nodes_m)).max())
        self._rounding_n *= float(lengths_m.max())

    def solve(self, x: Array, held_at_m: Array) -> Array:
        """Return the equilibrium nearest to `x` with the held nodes where they must be."""
        x = self._predict(x, held_at_m - x[self._held])
        x[self._held] = held_at_m
        energy, gradient, reduced = self._energy(x)
        for _ in range(MAX_ITERATIONS):
            if not np.isfinite(energy):
                raise _NoProgress
            self.residual_n = largest(reduced)
            if self.residual_n <= max(self._tol * largest(gradient.ravel()), self._rounding_n):
                return x
            self.iterations += 1
            self._factorize(x)
            direction = -self._solver.solve(reduced)
            x, energy, gradient, reduced = self._search(x, direction, energy, reduced)
        raise _NoProgress

    def _energy(self, x: Array) -> tuple[float, Array, Array]:
        gradient = np.zeros_like(x)
        energy = self._body.energy_gradient(x, gradient)
        reduced = gradient.ravel()[self._body.pattern.free]
        reduced[self._held_rows] = 0.0
        return energy, gradient, reduced

    def _factorize(self, x: Array) -> Array:
        """Factor the exact tangent, or its projection where that is not positive definite."""
        hessian = self._body.hessian(x, project=False)
        try:
            self._solver.factorize(self._led.put_into(hessian.copy()))
        except FactorizationFailed:
            hessian = self._body.hessian(x)
            self._solver.factorize(self._led.put_into(hessian.copy()))
        return hessian

    def _predict(self, x: Array, lead: Array) -> Array:
        """Return the linear answer to the held nodes' next displacement."""
        pattern = self._body.pattern
        hessian = self._factorize(x)
        moved = np.zeros(pattern.n)
        moved[self._held_rows] = lead.ravel()
        pull = kernels.symmetric_product(pattern.indptr, pattern.indices, hessian, moved)
        pull[self._held_rows] = 0.0
        answer = self._solver.solve(-self._energy(x)[2] - pull)
        answer[self._held_rows] = moved[self._held_rows]
        return x + self._expanded(answer, x)

    def _expanded(self, reduced: Array, like: Array) -> Array:
        full = np.zeros(like.size)
        full[self._body.pattern.free] = reduced
        return full.reshape(like.shape)

    def _search(
        self, x: Array, direction: Array, energy: float, reduced: Array
    ) -> tuple[Array, float, Array, Array]:
        full = self._expanded(direction, x)
        slope = float(direction @ reduced)
        length = 1.0
        for _ in range(MAX_HALVINGS):
            x_new = x + length * full
            energy_new, gradient, reduced_new = self._energy(x_new)
            falls = energy_new <= energy + ARMIJO * length * slope
            # Close to the solution the energy's change is rounding, the residual's is not.
            closer = length == 1.0 and largest(reduced_new) <= 0.5 * largest(reduced)
            if np.isfinite(energy_new) and (falls or closer):
                return x_new, energy_new, gradient, reduced_new
            length *= 0.5
        raise _NoProgress


def _checked_supports(
    nodes_m: Array, fixed: ArrayLike, prescribed: Mapping[int, Sequence[float]]
) -> tuple[NDArray[np.int32], Array]:
    n_nodes = len(nodes_m)
    held = np.array(sorted(prescribed), dtype=np.int64)
    fixed_nodes = np.unique(np.asarray(fixed, dtype=np.int64))
    displacement = np.array([prescribed[int(node)] for node in held], dtype=np.float64)
    for name, ids in (("fixed", fixed_nodes), ("prescribed", held)):
        if len(ids) and (ids.min() < 0 or ids.max() >= n_nodes):
            raise BadParameter(name, [int(ids.min()), int(ids.max())], f"nodes 0 to {n_nodes - 1}")
    if len(held) and (displacement.shape[1:] != (3,) or not np.isfinite(displacement).all()):
        raise BadParameter("prescribed", "a displacement", "three finite numbers in metres a node")
    both = np.intersect1d(fixed_nodes, held)
    if len(both):
        raise BadParameter("prescribed", int(both[0]), "nodes that are not fixed as well")
    supports = nodes_m[np.concatenate([fixed_nodes, held])]
    if len(supports) < 3 or np.linalg.matrix_rank(supports - supports[0]) < 2:
        raise BadParameter("fixed", len(supports), "three supported nodes that are not on one line")
    return held.astype(np.int32), displacement.reshape(len(held), 3)
