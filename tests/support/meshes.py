"""Boxes of every cell that the simulator knows."""

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem import Cell, box_mesh, split_into_tetrahedra, with_midside_nodes

CELLS: tuple[Cell, ...] = ("hex8", "tet4", "tet10")


def box(
    cell: Cell,
    counts: tuple[int, int, int] = (3, 4, 1),
    size_m: tuple[float, float, float] = (0.1, 0.12, 0.005),
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Nodes and elements in VTK's order, to be changed at will; `counts` are hexahedra."""
    nx, ny, nz = counts
    mesh = box_mesh(size_m, (nx + 1, ny + 1, nz + 1))
    if cell != "hex8":
        mesh = split_into_tetrahedra(mesh)
    if cell == "tet10":
        mesh = with_midside_nodes(mesh)
    return mesh.nodes_m.copy(), mesh.elements.astype(np.int64)
