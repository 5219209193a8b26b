"""Undo inverted elements after a release, so that the tissue can return to rest."""

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem import kernels
from fras_sim.fem.assembly import ElasticBody
from fras_sim.fem.linear_solver import LinearSolver
from fras_sim.fem.pattern import IdentityRows

FIRST_RINGS = 2


def heal(
    body: ElasticBody, solver: LinearSolver, x: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Replace the positions around inverted elements by those of linear elasticity.

    Parameters
    ----------
    body : ElasticBody
    solver : LinearSolver
        For the pattern of `body`; its factor is replaced.
    x : ndarray, shape (n_nodes, 3), float64 [m]

    Returns
    -------
    healed : ndarray, shape (n_nodes, 3), float64 [m]
        Without inverted elements.
    moved : ndarray of int32
        Nodes that were given a new position; empty if nothing was inverted.

    Notes
    -----
    St Venant-Kirchhoff has minima with det F < 0, and an element that sits in one holds its
    neighbours. Small-strain elasticity, K u = 0 with the stiffness of the rest shape, has only one
    solution for given displacements around a region, so the region forgets how it was folded. It
    starts with two rings of elements and doubles until nothing in the body is inverted; at the
    latest with the whole body, whose solution is the rest shape.
    """
    _, inverted = body.strain(x)
    moved = np.zeros(0, dtype=np.int32)
    if len(inverted) == 0:
        return x, moved
    stiffness = body.hessian(body.mesh.nodes_m)
    healed = x
    rings = FIRST_RINGS
    while len(inverted):
        inside = _interior(body.mesh.elements, len(x), inverted, rings)
        moved = np.flatnonzero(inside).astype(np.int32)
        healed = (
            body.mesh.nodes_m + _drift(body, x)
            if inside.all()
            else _linear_answer(body, solver, stiffness, x, inside)
        )
        still_inverted = body.strain(healed)[1]
        if inside.all() or len(still_inverted) == 0:
            break
        inverted = np.union1d(inverted, still_inverted)
        rings *= 2
    return healed, moved


def _drift(body: ElasticBody, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far a body that is fixed nowhere has moved as a whole."""
    is_fixed_nowhere = body.pattern.n == x.size
    return (x - body.mesh.nodes_m).mean(axis=0) if is_fixed_nowhere else np.zeros(3)


def _interior(
    elements: NDArray[np.int32], n_nodes: int, seeds: NDArray[np.int32], rings: int
) -> NDArray[np.bool_]:
    """Return which nodes belong to no element outside the seeds and their rings."""
    in_region = np.zeros(len(elements), dtype=bool)
    in_region[seeds] = True
    for _ in range(rings):
        touched = np.zeros(n_nodes, dtype=bool)
        touched[elements[in_region]] = True
        in_region = touched[elements].any(axis=1)
    inside = np.ones(n_nodes, dtype=bool)
    inside[elements[~in_region]] = False
    return inside


def _linear_answer(
    body: ElasticBody,
    solver: LinearSolver,
    stiffness: NDArray[np.float64],
    x: NDArray[np.float64],
    inside: NDArray[np.bool_],
) -> NDArray[np.float64]:
    pattern = body.pattern
    displacement = (x - body.mesh.nodes_m).ravel()[pattern.free]
    is_unknown = np.repeat(inside, 3)[pattern.free]
    known = np.where(is_unknown, 0.0, displacement)
    load = -kernels.symmetric_product(pattern.indptr, pattern.indices, stiffness, known)
    outside = np.flatnonzero(~is_unknown).astype(np.int32)
    load[outside] = known[outside]
    solver.factorize(IdentityRows(pattern, outside).put_into(stiffness.copy()))
    answer = body.mesh.nodes_m.copy()
    answer.reshape(-1)[pattern.free] += solver.solve(load)
    return answer
