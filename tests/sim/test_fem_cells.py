from typing import cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fras_sim.fem import (
    BadMesh,
    Cell,
    Mesh,
    box_mesh,
    make_mesh,
    split_into_tetrahedra,
    with_midside_nodes,
)
from fras_sim.fem.cells import TOPOLOGY

COUNTS = st.tuples(*[st.integers(2, 4)] * 3)


def box_of(cell, size_m=(0.03, 0.04, 0.02), counts=(3, 4, 3)):
    mesh = box_mesh(size_m, counts)
    if cell == "hex8":
        return mesh
    mesh = split_into_tetrahedra(mesh)
    return mesh if cell == "tet4" else with_midside_nodes(mesh)


@settings(max_examples=20, deadline=None)
@given(cell=st.sampled_from(["hex8", "tet4", "tet10"]), counts=COUNTS)
def test_surface_is_closed_outward_and_covers_the_box(cell, counts):
    mesh = box_of(cell, (0.1, 0.2, 0.3), counts)
    a, b, c = (mesh.nodes_m[mesh.surface[:, i]] for i in range(3))
    assert np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0 == pytest.approx(0.006, rel=1e-9)
    assert mesh.surface_area_m2.sum() == pytest.approx(2 * (0.02 + 0.06 + 0.03), rel=1e-9)
    edges = np.sort(mesh.surface[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    bottom = np.flatnonzero(mesh.nodes_m[:, 2] < 1e-12)
    np.testing.assert_array_equal(mesh.bottom_nodes, bottom)


def test_a_tet10_face_has_four_triangles_and_every_edge_its_middle():
    mesh = box_of("tet10", counts=(2, 2, 2))
    assert len(mesh.elements) == 6
    assert len(mesh.surface) == 4 * 12
    corners = mesh.nodes_m[mesh.elements[:, :4]]
    for midside, (a, b) in enumerate(TOPOLOGY["tet4"].edges, start=4):
        middle_m = (corners[:, a] + corners[:, b]) / 2
        np.testing.assert_allclose(mesh.nodes_m[mesh.elements[:, midside]], middle_m, atol=1e-15)
    # Neighbours are half an edge apart: the longest edge is the box's diagonal.
    assert mesh.spacing_m == pytest.approx(np.linalg.norm([0.03, 0.04, 0.02]) / 2)


@pytest.mark.parametrize("cell", ["hex8", "tet4", "tet10"])
def test_the_bottom_of_a_curved_slab_is_its_underside_without_the_rim(cell):
    flat = box_of(cell, (0.1, 0.12, 0.005), (9, 9, 3))
    x, y, z = flat.nodes_m.T
    bent = flat.nodes_m + np.stack([0 * x, 0 * x, 0.01 * np.sin(30 * x) + 0.005 * y / 0.12], 1)
    mesh = make_mesh(bent, flat.elements, cell)
    np.testing.assert_array_equal(mesh.bottom_nodes, np.flatnonzero(z < 1e-12))


def test_what_does_not_fit_the_cell_is_refused():
    mesh = box_of("tet4")
    with pytest.raises(BadMesh, match="hex8 needs 8 nodes"):
        make_mesh(mesh.nodes_m, mesh.elements, "hex8")
    with pytest.raises(BadMesh, match="hex8, tet4, tet10"):
        make_mesh(mesh.nodes_m, mesh.elements, cast("Cell", "wedge6"))
    with pytest.raises(BadMesh, match="no element"):
        make_mesh(mesh.nodes_m, np.zeros((0, 4)), "tet4")
    with pytest.raises(BadMesh, match=r"\(n_nodes, 3\)"):
        make_mesh(mesh.nodes_m[:, :2], mesh.elements, "tet4")
    with pytest.raises(BadMesh, match="outside"):
        Mesh(mesh.nodes_m[:3], mesh.elements, mesh.surface, "tet4")
    with pytest.raises(BadMesh, match="give hex8"):
        split_into_tetrahedra(mesh)
    with pytest.raises(BadMesh, match="give tet4"):
        with_midside_nodes(box_of("hex8"))
