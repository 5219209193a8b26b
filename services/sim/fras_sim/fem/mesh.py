"""Meshes: the body at rest, its surface, its bottom; the tissue box."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fras_sim.fem.cells import TOPOLOGY, Cell
from fras_sim.fem.errors import BadMesh

# A face looks down if its outward normal is within 60 degrees of straight down.
DOWNWARD = -0.5


@dataclass(frozen=True, eq=False)
class Mesh:
    """A body at rest, made of elements of one kind; `make_mesh` finds the surface.

    Parameters
    ----------
    nodes_m : ndarray, shape (n_nodes, 3), float64 [m]
        Rest positions in the world frame. The order of the nodes decides the bandwidth of the
        stiffness matrix: number slice by slice along the body's longest side.
    elements : ndarray, shape (n_elements, nodes per element), int32
        Node ids in the order of VTK: VTK_HEXAHEDRON, VTK_TETRA, VTK_QUADRATIC_TETRA.
    surface : ndarray, shape (n_triangles, 3), int32
        Triangles of the boundary, normals outward.
    cell : {"hex8", "tet4", "tet10"}

    Raises
    ------
    BadMesh
        If there is no element, its number of nodes does not fit the cell, an id is out of range,
        a node belongs to no element or a coordinate is not finite.
    """

    nodes_m: NDArray[np.float64]
    elements: NDArray[np.int32]
    surface: NDArray[np.int32]
    cell: Cell = "hex8"

    def __post_init__(self) -> None:
        n_nodes = len(self.nodes_m)
        if self.cell not in TOPOLOGY:
            raise BadMesh(
                f"cell = {self.cell!r} is not known: give one of {', '.join(TOPOLOGY)}",
                cell=self.cell,
            )
        if len(self.elements) == 0:
            raise BadMesh(
                f"the mesh has {n_nodes} node(s) and no element: give at least 2x2x2 nodes",
                n_nodes=n_nodes,
            )
        columns = TOPOLOGY[self.cell].n_nodes
        if self.elements.shape[1:] != (columns,):
            raise BadMesh(
                f"elements have the shape {self.elements.shape}, "
                f"{self.cell} needs {columns} nodes each",
                cell=self.cell,
            )
        if not np.isfinite(self.nodes_m).all():
            bad = int(np.flatnonzero(~np.isfinite(self.nodes_m).all(axis=1))[0])
            raise BadMesh(f"node {bad} has a coordinate that is not finite", node=bad)
        if self.elements.min() < 0 or self.elements.max() >= n_nodes:
            outside = (self.elements < 0) | (self.elements >= n_nodes)
            bad = int(np.flatnonzero(outside.any(axis=1))[0])
            raise BadMesh(f"element {bad} names a node outside 0..{n_nodes - 1}", n_nodes=n_nodes)
        loose = np.flatnonzero(np.bincount(self.elements.ravel(), minlength=n_nodes) == 0)
        if len(loose):
            raise BadMesh(
                f"node {loose[0]} belongs to no element: remove it or connect it",
                node=int(loose[0]),
            )

    @cached_property
    def bottom_nodes(self) -> NDArray[np.int32]:
        """Ids of the nodes of all boundary triangles that look down, ascending.

        Of a box that is its lowest plane, of a curved slab its underside without the rim.
        """
        normal = self._surface_normals
        length = np.linalg.norm(normal, axis=1)
        return np.unique(self.surface[normal[:, 2] < DOWNWARD * length]).astype(np.int32)

    @cached_property
    def spacing_m(self) -> float:
        """Longest distance of neighbours in an element: "one node spacing" for a grasp [m]."""
        ends = self.nodes_m[self.elements[:, TOPOLOGY[self.cell].edges]]
        return float(np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2).max())

    @cached_property
    def surface_area_m2(self) -> NDArray[np.float64]:
        """Share of the boundary's area that each node carries, shape (n_nodes,) [m²]."""
        third_m2 = np.linalg.norm(self._surface_normals, axis=1) / 6.0
        area_m2 = np.zeros(len(self.nodes_m))
        np.add.at(area_m2, self.surface, third_m2[:, None])
        return area_m2

    @cached_property
    def _surface_normals(self) -> NDArray[np.float64]:
        """Outward normals of the triangles, twice as long as their area is large."""
        a, b, c = (self.nodes_m[self.surface[:, corner]] for corner in range(3))
        return np.cross(b - a, c - a)


def make_mesh(nodes_m: ArrayLike, elements: ArrayLike, cell: Cell) -> Mesh:
    """Return a mesh with its surface.

    Parameters
    ----------
    nodes_m : array_like, shape (n_nodes, 3) [m]
    elements : array_like of int, shape (n_elements, nodes per element)
        In the order of VTK.
    cell : {"hex8", "tet4", "tet10"}

    Raises
    ------
    BadMesh
        See `Mesh`.
    """
    nodes = np.ascontiguousarray(nodes_m, dtype=np.float64)
    ids = np.ascontiguousarray(elements, dtype=np.int32)
    if nodes.ndim != 2 or nodes.shape[1] != 3:
        raise BadMesh(f"nodes_m has the shape {nodes.shape}: give (n_nodes, 3)", shape=nodes.shape)
    fits = cell in TOPOLOGY and len(ids) > 0 and ids.shape[1:] == (TOPOLOGY[cell].n_nodes,)
    # What does not fit is named by Mesh itself.
    surface = surface_triangles(ids, cell) if fits else np.zeros((0, 3), dtype=np.int32)
    return Mesh(nodes, ids, surface, cell)


def surface_triangles(elements: NDArray[np.int32], cell: Cell = "hex8") -> NDArray[np.int32]:
    """Return the boundary of a mesh as outward triangles.

    Parameters
    ----------
    elements : ndarray, shape (n_elements, nodes per element), int32
    cell : {"hex8", "tet4", "tet10"}

    Returns
    -------
    ndarray, shape (n_triangles, 3), int32
        For each face that only one element has: two triangles of a hex8, one of a tet4, four of a
        tet10.
    """
    topology = TOPOLOGY[cell]
    faces = elements[:, topology.faces].reshape(-1, topology.faces.shape[1])
    _, first, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    boundary = faces[np.sort(first[count == 1])]
    return boundary[:, topology.face_triangles].reshape(-1, 3).astype(np.int32)


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
