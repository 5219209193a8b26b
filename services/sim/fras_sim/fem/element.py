"""The 8-node hexahedron: shape functions, quadrature, selective reduced integration."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.errors import BadMesh, BadParameter
from fras_sim.fem.mesh import Mesh

ElementKind = Literal["hex8", "hex8-sri"]

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
CENTRE = np.zeros((1, 3))
CENTRE_WEIGHT = 8.0


@dataclass(frozen=True, eq=False)
class Quadrature:
    """Where the energy of each element is sampled, and with which weight.

    Parameters
    ----------
    gradients : ndarray, shape (n_elements, n_points, 3, 8), float64 [1/m]
        Derivatives dN_a/dX_j of the shape functions in the rest configuration.
    shear_weights, bulk_weights : ndarray, shape (n_elements, n_points), float64 [m³]
        Volume with which the point counts for mu E:E and for (lambda/2) (tr E)².
    nodal_volumes : ndarray, shape (n_elements, 8), float64 [m³]
        Integral of N_a: the share of the element's volume that each of its nodes carries.
    """

    gradients: NDArray[np.float64]
    shear_weights: NDArray[np.float64]
    bulk_weights: NDArray[np.float64]
    nodal_volumes: NDArray[np.float64]


def shape_functions(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return N_a at parent points, shape (n_points, 8), for points of shape (n_points, 3)."""
    return np.prod(1.0 + points[:, None, :] * CORNERS, axis=2) / 8.0


def shape_derivatives(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return dN_a/dxi_j at parent points, shape (n_points, 8, 3)."""
    factors = 1.0 + points[:, None, :] * CORNERS
    cyclic = [(1, 2), (2, 0), (0, 1)]
    return np.stack(
        [
            CORNERS[:, j] * factors[..., k] * factors[..., m] / 8.0
            for j, (k, m) in enumerate(cyclic)
        ],
        axis=-1,
    )


def quadrature(mesh: Mesh, kind: ElementKind = "hex8-sri") -> Quadrature:
    """Return the quadrature of each element of a mesh.

    Parameters
    ----------
    mesh : Mesh
    kind : {"hex8-sri", "hex8"}
        ``hex8`` samples the whole energy at 2x2x2 Gauss points. ``hex8-sri`` (selective reduced
        integration) samples mu E:E there and (lambda/2) (tr E)² at the centre alone.

    Raises
    ------
    BadMesh
        If an element is inverted or flat at rest.
    BadParameter
        If `kind` is none of the two.

    Notes
    -----
    Full integration locks in thin, nearly incompressible bodies: +24 % on a tool's reaction at
    21x25x2 nodes. With the split the discrete energy is still a sum of exact densities, so the
    forces derive from it and the tangent is symmetric (Hughes, *The Finite Element Method*, 1987,
    section 4.4: reduced and selective integration).
    """
    gauss, gauss_volumes = _gradients(mesh, GAUSS_POINTS)
    nodal_volumes = gauss_volumes @ shape_functions(GAUSS_POINTS)
    if kind == "hex8":
        return Quadrature(gauss, gauss_volumes, gauss_volumes, nodal_volumes)
    if kind != "hex8-sri":
        raise BadParameter("element", kind, "'hex8-sri' or 'hex8'")
    centre, centre_volumes = _gradients(mesh, CENTRE)
    centre_volumes = centre_volumes * CENTRE_WEIGHT
    return Quadrature(
        gradients=np.ascontiguousarray(np.concatenate([gauss, centre], axis=1)),
        shear_weights=np.concatenate([gauss_volumes, np.zeros_like(centre_volumes)], axis=1),
        bulk_weights=np.concatenate([np.zeros_like(gauss_volumes), centre_volumes], axis=1),
        nodal_volumes=nodal_volumes,
    )


def _gradients(
    mesh: Mesh, points: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return dN_a/dX_j, shape (n_elements, n_points, 3, 8), and det dX/dxi."""
    parent: NDArray[np.float64] = shape_derivatives(points)
    corners_m = mesh.nodes_m[mesh.elements]
    jacobian: NDArray[np.float64] = np.einsum("eai,qaj->eqij", corners_m, parent)
    determinant = np.linalg.det(jacobian)
    bad = np.flatnonzero((determinant <= 0.0).any(axis=1))
    if len(bad):
        raise BadMesh(
            f"element {bad[0]} is inverted or flat at rest: number its nodes as VTK_HEXAHEDRON",
            element=int(bad[0]),
        )
    gradients: NDArray[np.float64] = np.einsum("qak,eqkj->eqja", parent, np.linalg.inv(jacobian))
    return np.ascontiguousarray(gradients), determinant
