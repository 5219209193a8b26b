"""Meshes from files: every format and cell comes back as it was; what is no mesh is named."""

import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from fras_sim import mesh_file
from fras_sim.fem import BadMesh, Cell, make_mesh
from fras_sim.fem.validation import ImplausibleSize, NoVolumeElements, UnreferencedNodes
from fras_sim.mesh_file import (
    CELLS,
    FORMATS,
    MixedCells,
    UnknownMeshFormat,
    UnreadableMesh,
    mesh_facts,
    read_mesh,
)
from support.meshes import box

NAME_OF: dict[Cell, str] = {ours: theirs for theirs, ours in CELLS.items()}
# MEDIT, SU2 and AVS know no quadratic tetrahedra.
LINEAR_ONLY = {".mesh", ".su2", ".avs"}
CASES = [
    (suffix, cell)
    for suffix in FORMATS
    for cell in NAME_OF
    if cell != "tet10" or suffix not in LINEAR_ONLY
]

Write = Callable[..., bytes]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def written(suffix: str, points: Any, cells: list[Any], **options: Any) -> bytes:
        path = tmp_path / f"written{suffix}"
        options.setdefault("file_format", FORMATS.get(suffix, (suffix[1:],))[0])
        meshio.Mesh(points, cells).write(path, **options)
        return path.read_bytes()

    return written


@pytest.mark.parametrize(("suffix", "cell"), CASES)
def test_every_format_and_cell_comes_back(write: Write, suffix: str, cell: Cell) -> None:
    nodes_m, elements = box(cell)
    mesh = read_mesh(write(suffix, nodes_m, [(NAME_OF[cell], elements)]), f"some/where{suffix}")
    assert mesh.cell == cell
    np.testing.assert_array_equal(mesh.elements, elements)
    np.testing.assert_allclose(mesh.nodes_m, nodes_m, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(mesh.surface, make_mesh(nodes_m, elements, cell).surface)


@pytest.mark.parametrize("file_format", ["gmsh22", "gmsh"])
@pytest.mark.parametrize("binary", [False, True])
def test_gmsh_old_and_new_text_and_binary(write: Write, file_format: str, binary: bool) -> None:
    nodes_m, elements = box("tet10")
    data = write(".msh", nodes_m, [("tetra10", elements)], file_format=file_format, binary=binary)
    np.testing.assert_array_equal(read_mesh(data, "x.MSH").elements, elements)


def test_gmshs_own_order_of_midside_nodes_becomes_vtks() -> None:
    """By hand, as Gmsh's manual draws Tetrahedron10: its last two midside nodes are swapped."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * 0.1
    gmsh_edges = [(0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3)]
    points = [*corners, *[(corners[a] + corners[b]) / 2 for a, b in gmsh_edges]]
    lines = [f"{i} {x:.17g} {y:.17g} {z:.17g}" for i, (x, y, z) in enumerate(points, 1)]
    head = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", "10"]
    tail = ["$EndNodes", "$Elements", "1", "1 11 2 1 1 1 2 3 4 5 6 7 8 9 10", "$EndElements", ""]
    text = "\n".join([*head, *lines, *tail])
    mesh = read_mesh(text.encode(), "one.msh")
    (element,) = mesh.nodes_m[mesh.elements]
    for node, (a, b) in enumerate([(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)], 4):
        np.testing.assert_allclose(element[node], (element[a] + element[b]) / 2, atol=1e-15)


@pytest.mark.parametrize("cell", NAME_OF)
def test_the_body_is_scaled_and_moved_to_the_origin(write: Write, cell: Cell) -> None:
    nodes_m, elements = box(cell, size_m=(0.08, 0.11, 0.006))
    points = 1000.0 * nodes_m + np.array([-40.0, 250.0, 17.0])
    mesh = read_mesh(write(".vtu", points, [(NAME_OF[cell], elements)]), "x.vtu", 0.001)
    assert (mesh.nodes_m.min(axis=0) == 0.0).all()
    assert mesh_facts(mesh).size_m == pytest.approx((0.08, 0.11, 0.006))
    with pytest.raises(ImplausibleSize, match=r"millimetres\? scale = 0\.001"):
        read_mesh(write(".vtu", points, [(NAME_OF[cell], elements)]), "x.vtu")


def test_faces_edges_and_their_own_nodes_are_left_out(write: Write) -> None:
    nodes_m, elements = box("tet4")
    mesh = make_mesh(nodes_m, elements, "tet4")
    points = np.concatenate([[[0.5, 0.5, 0.5]], nodes_m])  # the centre of an arc, say
    half = len(elements) // 2
    cells = [
        ("vertex", [[0]]),
        ("triangle", mesh.surface + 1),
        ("tetra", elements[:half] + 1),
        ("line", [[1, 2]]),
        ("tetra", elements[half:] + 1),
    ]
    found = read_mesh(write(".vtu", points, cells), "x.vtu")
    np.testing.assert_array_equal(found.nodes_m, nodes_m)
    np.testing.assert_array_equal(found.elements, elements)


def test_a_node_of_no_cell_at_all_is_a_fault(write: Write) -> None:
    nodes_m, elements = box("tet4")
    points = np.concatenate([nodes_m, [[0.05, 0.05, 0.05]]])
    with pytest.raises(UnreferencedNodes) as caught:
        read_mesh(write(".vtu", points, [("tetra", elements)]), "x.vtu")
    assert caught.value.values["ids"] == [len(nodes_m)]


def test_a_surface_alone_is_refused_with_what_to_do(write: Write) -> None:
    nodes_m, elements = box("tet4")
    surface = make_mesh(nodes_m, elements, "tet4").surface
    with pytest.raises(NoVolumeElements, match=r"holds triangle cells .* fill the surface"):
        read_mesh(write(".vtu", nodes_m, [("triangle", surface)]), "x.vtu")
    with pytest.raises(UnknownMeshFormat, match=r"'\.stl' holds surfaces only: give a volume"):
        read_mesh(b"solid", "organ.STL")
    with pytest.raises(UnknownMeshFormat, match=r"'' is no format known here.*\.vtu"):
        read_mesh(b"solid", "organ")


def test_mixed_and_foreign_volume_cells_are_counted(write: Write) -> None:
    nodes_m, elements = box("hex8")
    wedge = elements[:1, [0, 1, 3, 4, 5, 7]]
    mixed = [("hexahedron", elements[1:]), ("wedge", wedge)]
    with pytest.raises(
        MixedCells, match="11 hexahedron, 1 wedge cells: mesh it with one"
    ) as caught:
        read_mesh(write(".vtu", nodes_m, mixed), "x.vtu")
    assert caught.value.values["counts"] == {"hexahedron": 11, "wedge": 1}
    with pytest.raises(MixedCells, match="1 wedge cells"):
        read_mesh(write(".vtu", nodes_m, [("wedge", wedge)]), "x.vtu")


def test_what_another_format_wrote_is_named_as_unreadable(write: Write) -> None:
    nodes_m, elements = box("tet4")
    data = write(".vtu", nodes_m, [("tetra", elements)])
    for suffix in FORMATS.keys() - {".vtu"}:
        with pytest.raises((UnreadableMesh, NoVolumeElements)) as caught:
            read_mesh(data, f"x{suffix}")
        assert "fras-mesh-" not in str(caught.value)  # the temporary file is nobody's business


@pytest.mark.parametrize(
    "spelled", [b"*INCLUDE, INPUT=", b"*include,input=", b" * Include, input="]
)
def test_a_file_that_pulls_in_others_is_refused(
    write: Write, tmp_path: Path, spelled: bytes
) -> None:
    nodes_m, elements = box("tet4")
    write(".inp", nodes_m, [("tetra", elements)])
    with pytest.raises(UnreadableMesh, match="includes other files"):
        read_mesh(b"*NODE\n" + spelled + bytes(tmp_path / "written.inp") + b"\n", "x.inp")


@pytest.mark.parametrize("suffix", FORMATS)
def test_damaged_files_are_sound_or_refused_with_a_typed_error(write: Write, suffix: str) -> None:
    nodes_m, elements = box("tet4", (2, 2, 1))
    whole = write(suffix, nodes_m, [("tetra", elements)])
    rng = np.random.default_rng(len(whole))
    flipped = bytearray(whole)
    for place in rng.integers(0, len(whole), 4):
        flipped[place] ^= int(rng.integers(1, 256))
    for data in (whole[: len(whole) * 2 // 3], bytes(flipped)):
        with contextlib.suppress(UnreadableMesh, MixedCells, BadMesh):
            assert len(read_mesh(data, f"x{suffix}").elements) > 0


def test_a_file_that_asks_for_all_the_memory_costs_only_the_parser(write: Write) -> None:
    """One damaged tag has meshio allocate a table as long as the tag is large."""
    nodes_m, elements = box("tet4", (1, 1, 1))
    text = write(".msh", nodes_m, [("tetra", elements)], binary=False).decode()
    head, _, rest = text.partition("$Nodes\n")
    lines = rest.split("\n")
    counts = lines[1].split()
    assert counts[-1] == "8"
    lines[2] = "900000000000"  # the first node's tag
    with pytest.raises(UnreadableMesh, match="as gmsh"):
        read_mesh("\n".join([f"{head}$Nodes", *lines]).encode(), "bomb.msh")


def test_a_parser_that_does_not_come_to_an_end_is_stopped(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    nodes_m, elements = box("tet4", (1, 1, 1))
    data = write(".vtu", nodes_m, [("tetra", elements)])
    monkeypatch.setattr(mesh_file, "PARSE_TIMEOUT_S", 0.001)
    with pytest.raises(UnreadableMesh, match="not done within"):
        read_mesh(data, "x.vtu")
