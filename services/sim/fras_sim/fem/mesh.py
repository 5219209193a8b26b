"""Hexahedral meshes: the tissue box, its faces, its surface."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.errors import BadMesh

# Local nodes of the six faces of a VTK_HEXAHEDRON, each wound so that its normal points outward.
HEX8_FACES = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
)
HEX8_EDGES = np.array(
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]]
)
# Nodes at the same height to this much belong to the same face.
FACE_TOLERANCE_M = 1e-9


@dataclass(frozen=True, eq=False)
class Mesh:
    """A body of 8-node hexahedra at rest.

    Parameters
    ----------
    nodes_m : ndarray, shape (n_nodes, 3), float64 [m]
        Rest positions in the world frame. The order of the nodes decides the bandwidth of the
        stiffness matrix: number slice by slice along the body's longest side.
    elements : ndarray, shape (n_elements, 8), int32
        Node ids in the order of VTK_HEXAHEDRON.
    surface : ndarray, shape (n_triangles, 3), int32
        Triangles of the boundary, normals outward.

    Raises
    ------
    BadMesh
        If there is no element, an id is out of range, a node belongs to no element or a
        coordinate is not finite.
    """

    nodes_m: NDArray[np.float64]
    elements: NDArray[np.int32]
    surface: NDArray[np.int32]

    def __post_init__(self) -> None:
        n_nodes = len(self.nodes_m)
        if len(self.elements) == 0:
            raise BadMesh(
                f"the mesh has {n_nodes} node(s) and no element: give at least 2x2x2 nodes",
                n_nodes=n_nodes,
            )
        if not np.isfinite(self.nodes_m).all():
            bad = int(np.flatnonzero(~np.isfinite(self.nodes_m).all(axis=1))[0])
            raise BadMesh(f"node {bad} has a coordinate that is not finite", node=bad)
        if self.elements.min() < 0 or self.elements.max() >= n_nodes:
            raise BadMesh(f"an element names a node outside 0..{n_nodes - 1}", n_nodes=n_nodes)
        loose = np.flatnonzero(np.bincount(self.elements.ravel(), minlength=n_nodes) == 0)
        if len(loose):
            raise BadMesh(
                f"node {loose[0]} belongs to no element: remove it or connect it",
                node=int(loose[0]),
            )

    @cached_property
    def bottom_nodes(self) -> NDArray[np.int32]:
        """Ids of the nodes of the lowest plane, ascending."""
        height_m = self.nodes_m[:, 2]
        return np.flatnonzero(height_m <= height_m.min() + FACE_TOLERANCE_M).astype(np.int32)

    @cached_property
    def spacing_m(self) -> float:
        """Length of the longest element edge: what "one node spacing" means for a grasp [m]."""
        ends = self.nodes_m[self.elements[:, HEX8_EDGES]]
        return float(np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2).max())

    @cached_property
    def surface_area_m2(self) -> NDArray[np.float64]:
        """Share of the boundary's area that each node carries, shape (n_nodes,) [m²]."""
        a, b, c = (self.nodes_m[self.surface[:, corner]] for corner in range(3))
        third_m2 = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
        area_m2 = np.zeros(len(self.nodes_m))
        np.add.at(area_m2, self.surface, third_m2[:, None])
        return area_m2


def surface_triangles(elements: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the boundary of a hexahedral mesh as outward triangles.

    Parameters
    ----------
    elements : ndarray, shape (n_elements, 8), int32

    Returns
    -------
    ndarray, shape (n_triangles, 3), int32
        Two triangles for each face that only one element has.
    """
    faces = elements[:, HEX8_FACES].reshape(-1, 4)
    _, first, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    boundary = faces[np.sort(first[count == 1])]
    return boundary[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.int32)


def box_mesh(
    size_m: tuple[float, float, float] = (0.1, 0.12, 0.005),
    node_counts: tuple[int, int, int] = (21, 25, 2),
) -> Mesh:
    """Return a structured box with one corner in the origin, bottom at z = 0.

    Parameters
    ----------
    size_m : tuple of float
        Lengths along x, y, z [m].
    node_counts : tuple of int
        Number of nodes along x, y, z.

    Returns
    -------
    Mesh
        Node (i, j, k) has the id ``(j * nx + i) * nz + k``: a slice of constant y couples to its
        two neighbours only, so the stiffness matrix is block tridiagonal, its half bandwidth
        ``3 * (nx * nz + nz + 2) - 1``.

    Raises
    ------
    BadMesh
        If a length is not positive and finite or a count is below 2.
    """
    if not all(math.isfinite(length) and length > 0.0 for length in size_m):
        raise BadMesh(f"size_m = {size_m}: give three positive lengths in metres", size_m=size_m)
    if not all(count >= 2 for count in node_counts):
        raise BadMesh(
            f"node_counts = {node_counts}: give at least 2 nodes along each of x, y, z",
            node_counts=node_counts,
        )
    nx, ny, nz = node_counts
    x, y, z = (np.linspace(0.0, size_m[axis], node_counts[axis]) for axis in range(3))
    grid_y, grid_x, grid_z = np.meshgrid(y, x, z, indexing="ij")
    nodes_m = np.stack([grid_x, grid_y, grid_z], axis=-1).reshape(-1, 3)
    ids = np.arange(nx * ny * nz, dtype=np.int32).reshape(ny, nx, nz)
    corners = [
        (0, 0, 0),
        (1, 0, 0),
        (1, 1, 0),
        (0, 1, 0),
        (0, 0, 1),
        (1, 0, 1),
        (1, 1, 1),
        (0, 1, 1),
    ]
    elements = np.stack(
        [ids[j : j + ny - 1, i : i + nx - 1, k : k + nz - 1].ravel() for i, j, k in corners],
        axis=1,
    )
    return Mesh(nodes_m, elements, surface_triangles(elements))
