"""Patient geometry from the bytes of a mesh file; meshio knows the formats, we know tissue."""

# meshio carries no types.
# pyright: reportMissingTypeStubs=false, reportUnknownVariableType=false
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

import importlib
import re
import tempfile
from pathlib import Path, PurePath
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fras_common.errors import FrasError
from fras_common.scenario import MeshFacts
from fras_common.service.extras import require_extra
from fras_sim.fem.cells import Cell
from fras_sim.fem.element import CELL_OF
from fras_sim.fem.mesh import Mesh, make_mesh
from fras_sim.fem.validation import NoVolumeElements, validate_mesh

# Formats that keep a whole volume mesh in one file, by suffix: the modules of meshio to try.
FORMATS: Final[dict[str, tuple[str, ...]]] = {
    ".vtu": ("vtu",),
    ".vtk": ("vtk",),
    ".msh": ("gmsh", "ansys"),
    ".inp": ("abaqus",),
    ".mesh": ("medit",),
    ".bdf": ("nastran",),
    ".nas": ("nastran",),
    ".su2": ("su2",),
    ".avs": ("avsucd",),
}
CELLS: Final[dict[str, Cell]] = {"hexahedron": "hex8", "tetra": "tet4", "tetra10": "tet10"}
# Abaqus's keyword that has a reader open further files. What came over the bus opens none.
INCLUDE: Final = re.compile(rb"^\s*\*\s*include", re.IGNORECASE | re.MULTILINE)
SURFACE_ONLY: Final = (".stl", ".obj", ".ply", ".off")


class MeshFileError(FrasError):
    """A file that no mesh can be read from."""


class UnknownMeshFormat(MeshFileError):
    """A suffix that stands for no format we read. Attributes: ``name``, ``known``."""


class UnreadableMesh(MeshFileError):
    """The content is not what the suffix promises. Attributes: ``name``."""


class MixedCells(MeshFileError):
    """Volume elements of more than one kind, or of a kind we don't compute.

    Attributes: ``counts`` of elements by meshio's name of the cell.
    """


def read_mesh(data: bytes, name: str, scale: float = 1.0) -> Mesh:
    """Read, scale, check and place a volume mesh.

    Parameters
    ----------
    data : bytes
        The file's content.
    name : str
        Its name; the suffix tells the format.
    scale : float
        What makes metres of its numbers.

    Returns
    -------
    Mesh
        Moved so that its bounding box starts at the origin in x, y and z. Faces, edges and points
        that the file lists beside the volume are left out, with the nodes that only they use; the
        other nodes keep their order.

    Raises
    ------
    UnknownMeshFormat, UnreadableMesh, MixedCells
        No mesh can be read.
    BadMesh
        It can't be computed on; see `fem.validation.validate_mesh` for the kinds.
    """
    points, elements, cell = _volume(_parse(data, name))
    # What no number is stays none; the validation names it.
    with np.errstate(over="ignore", invalid="ignore"):
        nodes_m = points * scale
        validate_mesh(nodes_m, elements, cell, scale)
    return make_mesh(nodes_m - nodes_m.min(axis=0), elements, cell)


def mesh_facts(mesh: Mesh) -> MeshFacts:
    """Tell what a scenario must fit; the size to the nanometre, for people read it."""
    x, y, z = (round(float(extent), 9) for extent in np.ptp(mesh.nodes_m, axis=0))
    return MeshFacts(
        cell=mesh.cell,
        elements=tuple(element for element, cell in CELL_OF.items() if cell == mesh.cell),
        n_nodes=len(mesh.nodes_m),
        n_elements=len(mesh.elements),
        size_m=(x, y, z),
    )


def _parse(data: bytes, name: str) -> Any:
    suffix = PurePath(name).suffix.lower()
    if suffix not in FORMATS:
        why = "holds surfaces only" if suffix in SURFACE_ONLY else "is no format known here"
        raise UnknownMeshFormat(
            f"a mesh file with the suffix {suffix!r} {why}: give a volume mesh as "
            f"{', '.join(FORMATS)}",
            name=name,
            known=list(FORMATS),
        )
    if suffix == ".inp" and INCLUDE.search(data):
        raise UnreadableMesh(
            f"{PurePath(name).name} includes other files: put the whole mesh into one", name=name
        )
    problems: list[str] = []
    # meshio reads most binary formats by file descriptor: a buffer in memory won't do.
    with tempfile.TemporaryDirectory(prefix="fras-mesh-") as folder:
        path = Path(folder) / f"mesh{suffix}"
        path.write_bytes(data)
        for format_name in FORMATS[suffix]:
            with require_extra("sim"):
                reader = importlib.import_module(f"meshio.{format_name}")
            try:
                return reader.read(str(path))
            except Exception as error:  # noqa: BLE001 - its parsers raise whatever they trip over
                problems.append(f"as {format_name}: {type(error).__name__}: {error}")
    detail = "; ".join(problems).replace(str(path), PurePath(name).name)
    raise UnreadableMesh(
        f"no mesh could be read from the {len(data)} bytes of {PurePath(name).name} ({detail}): "
        "export it anew, or with another format",
        name=name,
    )


def _volume(parsed: Any) -> tuple[NDArray[np.float64], NDArray[np.int64], Cell]:
    """Pick the volume elements; number anew the nodes without those of faces, edges, points."""
    points = np.array(parsed.points, dtype=np.float64)
    volumes = [block for block in parsed.cells if block.dim == 3]
    others = [block for block in parsed.cells if block.dim != 3]
    counts: dict[str, int] = {}
    for block in volumes:
        counts[block.type] = counts.get(block.type, 0) + len(block)
    if not counts:
        found = ", ".join(sorted({block.type for block in others})) or "no"
        raise NoVolumeElements(
            f"the file holds {found} cells and no volume elements: fill the surface with "
            f"{', '.join(CELLS)} (a mesher such as Gmsh does) and export those",
            cell=found,
        )
    if len(counts) > 1 or not counts.keys() <= CELLS.keys():
        listed = ", ".join(f"{count} {kind}" for kind, count in sorted(counts.items()))
        raise MixedCells(
            f"the file's volume consists of {listed} cells: mesh it with one kind of "
            f"{', '.join(CELLS)} alone",
            counts=counts,
        )
    (kind,) = counts
    elements = np.concatenate([np.asarray(block.data, dtype=np.int64) for block in volumes])
    return *_without_loose(points, elements, others), CELLS[kind]


def _without_loose(
    points: NDArray[np.float64], elements: NDArray[np.int64], others: list[Any]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Leave out nodes that only cells of lower dimension use; those of no cell stay, as faults."""
    used = np.zeros(len(points), dtype=np.bool_)
    inside = elements[(elements >= 0) & (elements < len(points))]
    used[inside] = True
    loose = np.zeros(len(points), dtype=np.bool_)
    for block in others:
        ids = np.asarray(block.data, dtype=np.int64).ravel()
        loose[ids[(ids >= 0) & (ids < len(points))]] = True
    loose &= ~used
    if len(inside) < elements.size or not loose.any():
        return points, elements
    return points[~loose], (np.cumsum(~loose) - 1)[elements]
