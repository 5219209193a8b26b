"""Reference elements: shape functions, their derivatives, quadrature, lumping."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.cells import Cell

Array = NDArray[np.float64]

# Parent coordinates of the nodes of a VTK_HEXAHEDRON.
CORNERS = np.array(
    [
        [-1, -1, -1],
        [1, -1, -1],
        [1, 1, -1],
        [-1, 1, -1],
        [-1, -1, 1],
        [1, -1, 1],
        [1, 1, 1],
        [-1, 1, 1],
    ],
    dtype=np.float64,
)
GAUSS_POINTS = CORNERS / np.sqrt(3.0)
# Parent coordinates of the corners of a tetrahedron, and dL/dxi of its barycentric coordinates.
TET_CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
BARYCENTRIC_DERIVATIVES = np.array([[-1.0, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
# Corners next to each midside node of a VTK_QUADRATIC_TETRA, nodes 4 to 9.
MIDSIDES = np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]])
# Exact to degree 2 (Zienkiewicz, Taylor, *The Finite Element Method*, vol. 1, table of tetrahedra).
TET_FOUR_POINTS = (5.0 - np.sqrt(5.0)) / 20.0 + TET_CORNERS * np.sqrt(5.0) / 5.0


@dataclass(frozen=True, eq=False)
class ReferenceElement:
    """An element in parent coordinates xi.

    Parameters
    ----------
    shape : callable
        N_a at points (n_points, 3): shape (n_points, n_nodes).
    derivatives : callable
        dN_a/dxi_j at points (n_points, 3): shape (n_points, n_nodes, 3).
    points : ndarray, shape (n_points, 3)
    weights : ndarray, shape (n_points,)
        Quadrature; the weights sum up to the parent volume.
    lumping : ndarray, shape (n_nodes,), or None
        Share of the element's mass that each node carries; None if it is the integral of N_a.
    """

    shape: Callable[[Array], Array]
    derivatives: Callable[[Array], Array]
    points: Array
    weights: Array
    lumping: Array | None = None


def _hex8_shape(points: Array) -> Array:
    return np.prod(1.0 + points[:, None, :] * CORNERS, axis=2) / 8.0


def _hex8_derivatives(points: Array) -> Array:
    factors = 1.0 + points[:, None, :] * CORNERS
    cyclic = [(1, 2), (2, 0), (0, 1)]
    return np.stack(
        [
            CORNERS[:, j] * factors[..., k] * factors[..., m] / 8.0
            for j, (k, m) in enumerate(cyclic)
        ],
        axis=-1,
    )


def _tet4_shape(points: Array) -> Array:
    return np.concatenate([1.0 - points.sum(axis=1, keepdims=True), points], axis=1)


def _tet4_derivatives(points: Array) -> Array:
    return np.broadcast_to(BARYCENTRIC_DERIVATIVES, (len(points), 4, 3)).copy()


def _tet10_shape(points: Array) -> Array:
    L = _tet4_shape(points)
    return np.concatenate(
        [L * (2.0 * L - 1.0), 4.0 * L[:, MIDSIDES[:, 0]] * L[:, MIDSIDES[:, 1]]], axis=1
    )


def _tet10_derivatives(points: Array) -> Array:
    L = _tet4_shape(points)[:, :, None]
    dL = BARYCENTRIC_DERIVATIVES
    a, b = MIDSIDES.T
    return np.concatenate([(4.0 * L - 1.0) * dL, 4.0 * (L[:, a] * dL[b] + L[:, b] * dL[a])], axis=1)


REFERENCE: dict[Cell, ReferenceElement] = {
    "hex8": ReferenceElement(_hex8_shape, _hex8_derivatives, GAUSS_POINTS, np.ones(8)),
    "tet4": ReferenceElement(
        _tet4_shape, _tet4_derivatives, np.full((1, 3), 0.25), np.full(1, 1.0 / 6.0)
    ),
    # The integral of N_a is negative at the corners, so the diagonal of the consistent mass matrix,
    # scaled to the element's mass, takes its place (Hinton, Rock, Zienkiewicz, *Earthquake Eng.
    # Struct. Dyn.* 4, 1976).
    "tet10": ReferenceElement(
        _tet10_shape,
        _tet10_derivatives,
        TET_FOUR_POINTS,
        np.full(4, 1.0 / 24.0),
        np.concatenate([np.full(4, 1.0 / 36.0), np.full(6, 4.0 / 27.0)]),
    ),
}
