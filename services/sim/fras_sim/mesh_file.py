"""Patient geometry from the bytes of a mesh file; meshio knows the formats, we know tissue."""

import importlib.util
import os
import re
import subprocess
import sys
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fras_common.errors import FrasError
from fras_common.extras import MissingExtra
from fras_common.scenario import MeshFacts
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
PARSE_TIMEOUT_S: Final = 20.0
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


@dataclass(frozen=True, eq=False)
class _Block:
    """Cells of one kind, `type` as meshio calls them."""

    type: str
    dim: int
    data: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class _Parsed:
    points: NDArray[np.float64]
    cells: list[_Block]


def _parse(data: bytes, name: str) -> _Parsed:
    file_name = PurePath(name).name
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
            f"{file_name} includes other files: put the whole mesh into one", name=name
        )
    if importlib.util.find_spec("meshio") is None:
        raise MissingExtra(
            "sim needs the library 'meshio': install it with `pip install 'fras[sim]'`",
            service="sim",
            library="meshio",
        )
    problems: list[str] = []
    with tempfile.TemporaryDirectory(prefix="fras-mesh-") as folder:
        source, target = Path(folder) / f"mesh{suffix}", Path(folder) / "parsed.npz"
        source.write_bytes(data)
        for format_name in FORMATS[suffix]:
            problem = _run_parser(format_name, source, target)
            if not problem:
                try:
                    return _load(target)
                except (OSError, ValueError, zipfile.BadZipFile) as error:
                    problem = f"{type(error).__name__}: {error}"
            problems.append(f"as {format_name}: {problem.replace(str(source), file_name)}")
    raise UnreadableMesh(
        f"no mesh could be read from the {len(data)} bytes of {file_name} "
        f"({'; '.join(problems)}): export it anew, or with another format",
        name=name,
    )


def _run_parser(format_name: str, source: Path, target: Path) -> str:
    """Run `mesh_parser`; return what went wrong, if anything."""
    command = [sys.executable, "-m", "fras_sim.mesh_parser", format_name, str(source), str(target)]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    try:
        done = subprocess.run(
            command,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=PARSE_TIMEOUT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"not done within {PARSE_TIMEOUT_S:.0f} s"
    if done.returncode == 0:
        return ""
    said = done.stderr.decode(errors="replace").strip().splitlines()
    return said[-1] if done.returncode > 0 and said else "it takes too much time or memory to read"


def _load(target: Path) -> _Parsed:
    with np.load(target, allow_pickle=False) as arrays:
        points = arrays["points"]
        cells = [
            _Block(kind, int(dim), arrays[key])
            for key in arrays.files
            if key != "points"
            for _, dim, kind in [key.split(" ", 2)]
        ]
    return _Parsed(points, cells)


def _volume(parsed: _Parsed) -> tuple[NDArray[np.float64], NDArray[np.int64], Cell]:
    """Pick the volume elements; number anew the nodes without those of faces, edges, points."""
    points = parsed.points
    volumes = [block for block in parsed.cells if block.dim == 3]
    others = [block for block in parsed.cells if block.dim != 3]
    counts: dict[str, int] = {}
    for block in volumes:
        counts[block.type] = counts.get(block.type, 0) + len(block.data)
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
    elements = np.concatenate([block.data for block in volumes])
    return *_without_loose(points, elements, others), CELLS[kind]


def _without_loose(
    points: NDArray[np.float64], elements: NDArray[np.int64], others: list[_Block]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Leave out nodes that only cells of lower dimension use; those of no cell stay, as faults."""
    used = np.zeros(len(points), dtype=np.bool_)
    inside = elements[(elements >= 0) & (elements < len(points))]
    used[inside] = True
    loose = np.zeros(len(points), dtype=np.bool_)
    for block in others:
        ids = block.data.ravel()
        loose[ids[(ids >= 0) & (ids < len(points))]] = True
    loose &= ~used
    if len(inside) < elements.size or not loose.any():
        return points, elements
    return points[~loose], (np.cumsum(~loose) - 1)[elements]
