"""Tetrahedral meshes from hexahedral ones, quadratic ones from linear ones."""

import numpy as np

from fras_sim.fem.cells import TOPOLOGY
from fras_sim.fem.errors import BadMesh
from fras_sim.fem.mesh import Mesh, make_mesh

# The six tetrahedra around the diagonal 0-6 of a hexahedron; in a structured mesh the diagonals
# of neighbouring faces coincide (Kuhn's triangulation).
KUHN = np.array(
    [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]]
)
# The ends of the edges of a tet10, in the order of its midside nodes 4..9.
TET_EDGES = TOPOLOGY["tet4"].edges


def split_into_tetrahedra(mesh: Mesh) -> Mesh:
    """Return the same nodes with each hexahedron of a structured mesh cut into six tet4.

    Raises
    ------
    BadMesh
        If the mesh is not one of hexahedra.
    """
    if mesh.cell != "hex8":
        raise BadMesh(f"a mesh of {mesh.cell} can't be split: give hex8", cell=mesh.cell)
    return make_mesh(mesh.nodes_m, mesh.elements[:, KUHN].reshape(-1, 4), "tet4")


def with_midside_nodes(mesh: Mesh) -> Mesh:
    """Return the tet10 mesh of the same shape as a tet4 mesh, each edge with a node in the middle.

    Nodes are renumbered along y, then x, then z, so that the stiffness matrix stays a band.

    Raises
    ------
    BadMesh
        If the mesh is not one of tet4.
    """
    if mesh.cell != "tet4":
        raise BadMesh(f"a mesh of {mesh.cell} has no edges to split: give tet4", cell=mesh.cell)
    ends = np.sort(mesh.elements[:, TET_EDGES], axis=2).reshape(-1, 2)
    edges, edge_of = np.unique(ends, axis=0, return_inverse=True)
    middle_m = mesh.nodes_m[edges].mean(axis=1)
    nodes_m = np.concatenate([mesh.nodes_m, middle_m])
    midside = len(mesh.nodes_m) + edge_of.reshape(-1, len(TET_EDGES))
    elements = np.concatenate([mesh.elements, midside], axis=1)
    order = np.lexsort((nodes_m[:, 2], nodes_m[:, 0], nodes_m[:, 1]))
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return make_mesh(nodes_m[order], rank[elements], "tet10")
