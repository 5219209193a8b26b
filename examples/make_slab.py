"""Make a mesh that looks like a patient's: `python examples/make_slab.py compose/meshes/slab.vtu`.

A slab of adipose tissue of about 100 x 120 mm with rounded corners, bent over what lies under it,
4 to 7 mm thick, in millimetres and somewhere in a scanner's coordinates, as segmentation software
exports it. The suffix chooses the format, `--cell` the elements.
"""

# meshio carries no types.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false

import argparse
from pathlib import Path

import meshio
import numpy as np
from numpy.typing import NDArray

from fras_sim.fem import Cell, Mesh, box_mesh, make_mesh, split_into_tetrahedra, with_midside_nodes

SIZE_MM = (100.0, 120.0)
ROUNDING = 0.6  # of the outline: 0 is a rectangle, 1 an ellipse
RISE_MM = 5.0  # of the underside, in the middle
THICKNESS_MM = (4.0, 7.0)
SCANNER_ORIGIN_MM = (-37.0, 112.0, -64.0)
NAME_OF = {"hex8": "hexahedron", "tet4": "tetra", "tet10": "tetra10"}


def slab(cell: Cell, node_counts: tuple[int, int, int]) -> Mesh:
    """Return the slab in its own coordinates, in millimetres.

    Parameters
    ----------
    cell : {"hex8", "tet4", "tet10"}
    node_counts : tuple of int
        Nodes along x, y, z; of the corners for tet10.
    """
    mesh = box_mesh((2.0, 2.0, 1.0), node_counts)
    if cell != "hex8":
        mesh = split_into_tetrahedra(mesh)
    mesh = make_mesh(_bent(mesh.nodes_m), mesh.elements, mesh.cell)
    return with_midside_nodes(mesh) if cell == "tet10" else mesh


def _bent(parent: NDArray[np.float64]) -> NDArray[np.float64]:
    """Map the box [0, 2] x [0, 2] x [0, 1] to the slab."""
    u, v, w = (parent - [1.0, 1.0, 0.0]).T
    # The elliptical grid mapping of a square to a disc, with part of its strength.
    x = 0.5 * SIZE_MM[0] * (1.0 + u * np.sqrt(1.0 - 0.5 * ROUNDING * v**2))
    y = 0.5 * SIZE_MM[1] * (1.0 + v * np.sqrt(1.0 - 0.5 * ROUNDING * u**2))
    bottom = RISE_MM * (1.0 - u**2) * (1.0 - 0.4 * v**2)
    thin, thick = THICKNESS_MM
    wave = 0.5 * (1.0 + np.sin(2.5 * u + 0.6) * np.cos(2.2 * v))
    return np.column_stack([x, y, bottom + w * (thin + (thick - thin) * wave)])


def main() -> None:
    """Write the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--cell", choices=list(NAME_OF), default="hex8")
    parser.add_argument("--nodes", type=int, nargs=3, default=(21, 25, 2), metavar=("X", "Y", "Z"))
    arguments = parser.parse_args()
    mesh = slab(arguments.cell, tuple(arguments.nodes))
    points = np.round(mesh.nodes_m, 6) + SCANNER_ORIGIN_MM
    meshio.Mesh(points, [(NAME_OF[mesh.cell], mesh.elements)]).write(arguments.file)
    print(f"{arguments.file}: {len(mesh.nodes_m)} nodes, {len(mesh.elements)} {mesh.cell}")


if __name__ == "__main__":
    main()
