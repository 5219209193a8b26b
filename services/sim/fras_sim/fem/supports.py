"""Where a body is fixed: what is allowed, and its patches."""
# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false
# pyright: reportUnknownArgumentType=false
# Reason: scipy.sparse ships no types.

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fras_sim.fem.cells import TOPOLOGY
from fras_sim.fem.errors import BadParameter
from fras_sim.fem.mesh import Mesh
from fras_sim.fem.parameters import TissueParameters


def checked_fixed(
    mesh: Mesh, fixed_nodes: ArrayLike, parameters: TissueParameters
) -> NDArray[np.int32]:
    """Return the fixed nodes, ascending, each once.

    Raises
    ------
    BadParameter
        If one does not exist, if none can move, if there is none and no bed, or if an equilibrium
        without inertia is wanted of a body that is free to turn.
    """
    n_nodes = len(mesh.nodes_m)
    nodes = np.unique(np.asarray(fixed_nodes, dtype=np.int64))
    if len(nodes) and (nodes[0] < 0 or nodes[-1] >= n_nodes):
        raise BadParameter("fixed_nodes", int(nodes[-1]), f"node ids from 0 to {n_nodes - 1}")
    if len(nodes) == n_nodes:
        raise BadParameter("fixed_nodes", "all", "at least one node that can move")
    if len(nodes) == 0 and not parameters.bed:
        raise BadParameter("fixed_nodes", "none", "at least one fixed node, or bed = True")
    at_m = mesh.nodes_m[nodes]
    if parameters.quasi_static and (len(nodes) < 3 or np.linalg.matrix_rank(at_m - at_m[0]) < 2):
        raise BadParameter(
            "fixed_nodes", len(nodes), "three nodes not on one line when quasi_static = True"
        )
    return nodes.astype(np.int32)


def fixed_patches(mesh: Mesh, fixed_nodes: NDArray[np.int32]) -> list[NDArray[np.int32]]:
    """Return the fixed nodes as patches: nodes that edges of elements connect.

    They are ordered by their lowest node; patches that touch are one.
    """
    edges = mesh.elements[:, TOPOLOGY[mesh.cell].edges].reshape(-1, 2)
    is_fixed = np.zeros(len(mesh.nodes_m), dtype=bool)
    is_fixed[fixed_nodes] = True
    a, b = edges[is_fixed[edges].all(axis=1)].T
    graph = coo_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(len(is_fixed),) * 2)
    _, label = connected_components(graph, directed=False)
    labels = label[fixed_nodes]
    _, first = np.unique(labels, return_index=True)
    return [fixed_nodes[labels == labels[k]].astype(np.int32) for k in np.sort(first)]
