"""The finite elements in their rest shape: gradients of shape functions, weights."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.cells import Cell
from fras_sim.fem.errors import BadMesh, BadParameter
from fras_sim.fem.mesh import Mesh
from fras_sim.fem.reference import CORNERS, REFERENCE

ElementKind = Literal["hex8-sri", "hex8", "tet4", "tet10"]

CELL_OF: dict[str, Cell] = {"hex8-sri": "hex8", "hex8": "hex8", "tet4": "tet4", "tet10": "tet10"}
CENTRE = np.zeros((1, 3))
CENTRE_WEIGHT = np.full(1, 8.0)


@dataclass(frozen=True, eq=False)
class Quadrature:
    """Where the energy of each element is sampled, and with which weight.

    Parameters
    ----------
    gradients : ndarray, shape (n_elements, n_points, 3, nodes per element), float64 [1/m]
        Derivatives dN_a/dX_j of the shape functions in the rest configuration.
    shear_weights, bulk_weights : ndarray, shape (n_elements, n_points), float64 [m³]
        Volume with which the point counts for the terms with mu and for those with lambda.
    nodal_volumes : ndarray, shape (n_elements, nodes per element), float64 [m³]
        The share of the element's volume that each of its nodes carries.
    """

    gradients: NDArray[np.float64]
    shear_weights: NDArray[np.float64]
    bulk_weights: NDArray[np.float64]
    nodal_volumes: NDArray[np.float64]


def checked_kind(kind: str, cell: Cell) -> ElementKind:
    """Return the element kind, if it fits the cells of the mesh.

    Raises
    ------
    BadParameter
        Naming the kinds that do.
    """
    for allowed, needed in CELL_OF.items():
        if kind == allowed and needed == cell:
            return kind  # pyright: ignore[reportReturnType]
    fitting = " or ".join(repr(name) for name, needed in CELL_OF.items() if needed == cell)
    raise BadParameter("element", kind, f"{fitting} for a mesh of {cell}")


def quadrature(
    mesh: Mesh, kind: ElementKind = "hex8-sri", poisson_ratio: float = 0.0
) -> Quadrature:
    """Return the quadrature of each element of a mesh.

    Parameters
    ----------
    mesh : Mesh
    kind : {"hex8-sri", "hex8", "tet4", "tet10"}
        ``hex8`` samples the whole energy at 2x2x2 Gauss points, ``tet4`` at one, ``tet10`` at
        four. ``hex8-sri`` (selective reduced integration) samples the terms with lambda at the
        centre alone, those with mu at 2x2x2 points and, for a part of their weight, at the centre.
    poisson_ratio : float
        Decides, for ``hex8-sri``, about that part.

    Raises
    ------
    BadMesh
        If an element is inverted or flat at rest.
    BadParameter
        If `kind` does not fit the mesh.

    Notes
    -----
    Full integration and linear tetrahedra lock in thin, nearly incompressible bodies: +24 % and
    +48 % on a tool's reaction at 21x25x2 nodes. With the split the discrete energy is still a sum
    of exact densities, so the forces derive from it and the tangent is symmetric (Hughes, *The
    Finite Element Method*, 1987, section 4.4: reduced and selective integration).

    What is left is parasitic shear. Where a plate bends with strain ``E_xx = k z``, the trilinear
    element adds ``E_xz = k x / 2`` and has, lambda being silent at the centre, the energy density
    ``mu k² (<z²> + <x²> / 2)`` in the place of ``E / (2 - 2 nu²) k² <z²> = mu k² <z²> / (1 - nu)``.
    An element ``a`` times as long as thick is too stiff by ``(1 - nu) (1 + a² / 2)``. So the points
    away from the centre, which see bending and no constant strain, count for the inverse of that,
    never for more than their share, and the centre for the rest: sheets of long elements bend as
    they should, constant strain stays exact (the aim of Belytschko, Bindeman, *Comput. Methods
    Appl. Mech. Eng.* 105, 1993, assumed strain stabilization, reached by weights alone). One number
    an element serves bending across its thin side; within the sheet it is somewhat too soft, by
    less the more elements there are.
    """
    kind = checked_kind(kind, mesh.cell)
    reference = REFERENCE[mesh.cell]
    full, volumes = _gradients(mesh, reference.points, reference.weights)
    nodal_volumes = (
        volumes @ reference.shape(reference.points)
        if reference.lumping is None
        else volumes.sum(axis=1, keepdims=True) * reference.lumping
    )
    if kind != "hex8-sri":
        return Quadrature(full, volumes, volumes, nodal_volumes)
    centre, centre_volumes = _gradients(mesh, CENTRE, CENTRE_WEIGHT)
    share = _bending_share(mesh, poisson_ratio)[:, None]
    at_centre = (1.0 - share) * volumes.sum(axis=1, keepdims=True)
    return Quadrature(
        gradients=np.ascontiguousarray(np.concatenate([full, centre], axis=1)),
        shear_weights=np.concatenate([share * volumes, at_centre], axis=1),
        bulk_weights=np.concatenate([np.zeros_like(volumes), centre_volumes], axis=1),
        nodal_volumes=nodal_volumes,
    )


def _bending_share(mesh: Mesh, poisson_ratio: float) -> NDArray[np.float64]:
    """Return how much the points away from the centre count, shape (n_elements,), at most 1."""
    corners_m = mesh.nodes_m[mesh.elements]
    # Twice the mean edge along each parent axis, squared.
    edges_m = np.einsum("eai,aj->eji", corners_m, CORNERS)
    squared = np.sort((edges_m**2).sum(axis=2), axis=1)
    aspect_squared = 0.5 * (squared[:, 1] + squared[:, 2]) / squared[:, 0]
    return np.minimum(1.0 / ((1.0 - poisson_ratio) * (1.0 + 0.5 * aspect_squared)), 1.0)


def _gradients(
    mesh: Mesh, points: NDArray[np.float64], weights: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return dN_a/dX_j, shape (n_elements, n_points, 3, nodes per element), and the volumes."""
    parent = REFERENCE[mesh.cell].derivatives(points)
    corners_m = mesh.nodes_m[mesh.elements]
    jacobian: NDArray[np.float64] = np.einsum("eai,qaj->eqij", corners_m, parent)
    determinant = np.linalg.det(jacobian)
    bad = np.flatnonzero((determinant <= 0.0).any(axis=1))
    if len(bad):
        raise BadMesh(
            f"element {bad[0]} is inverted or flat at rest: number its nodes in the order of VTK",
            element=int(bad[0]),
        )
    gradients: NDArray[np.float64] = np.einsum("qak,eqkj->eqja", parent, np.linalg.inv(jacobian))
    return np.ascontiguousarray(gradients), determinant * weights
