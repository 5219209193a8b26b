import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fras_sim.fem import BadMesh, Mesh, box_mesh
from fras_sim.fem.mesh import surface_triangles

COUNTS = st.tuples(*[st.integers(2, 5)] * 3)
SIZES = st.tuples(*[st.floats(1e-3, 0.2)] * 3)


@settings(max_examples=40, deadline=None)
@given(size_m=SIZES, counts=COUNTS)
def test_surface_is_closed_and_points_outward(size_m, counts):
    mesh = box_mesh(size_m, counts)
    a, b, c = (mesh.nodes_m[mesh.surface[:, i]] for i in range(3))
    volume_m3 = np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0
    assert volume_m3 == pytest.approx(np.prod(size_m), rel=1e-9)
    assert np.linalg.norm(np.cross(b - a, c - a).sum(axis=0)) < 1e-12
    x, y, z = size_m
    assert mesh.surface_area_m2.sum() == pytest.approx(2 * (x * y + y * z + z * x), rel=1e-9)


def test_default_box_is_the_design_s_tissue():
    mesh = box_mesh()
    assert mesh.nodes_m.shape == (21 * 25 * 2, 3)
    assert mesh.elements.shape == (20 * 24, 8)
    assert mesh.elements.dtype == np.int32
    assert mesh.surface.dtype == np.int32
    np.testing.assert_allclose(mesh.nodes_m.max(axis=0), [0.1, 0.12, 0.005])
    assert mesh.spacing_m == pytest.approx(0.005)
    assert len(mesh.bottom_nodes) == 21 * 25
    assert (mesh.nodes_m[mesh.bottom_nodes, 2] == 0.0).all()


def test_elements_follow_the_vtk_order():
    mesh = box_mesh((1.0, 1.0, 1.0), (2, 2, 2))
    expected = [
        [0, 0, 0],
        [1, 0, 0],
        [1, 1, 0],
        [0, 1, 0],
        [0, 0, 1],
        [1, 0, 1],
        [1, 1, 1],
        [0, 1, 1],
    ]
    np.testing.assert_array_equal(mesh.nodes_m[mesh.elements[0]], expected)


def test_slices_of_constant_y_couple_to_their_neighbours_only():
    mesh = box_mesh(node_counts=(4, 6, 3))
    slice_of = np.arange(len(mesh.nodes_m)) // (4 * 3)
    spread = slice_of[mesh.elements]
    assert (spread.max(axis=1) - spread.min(axis=1) == 1).all()


@pytest.mark.parametrize(
    ("size_m", "counts"),
    [
        ((0.1, 0.12, 0.005), (1, 1, 1)),
        ((0.1, 0.12, 0.005), (21, 1, 2)),
        ((0.1, -0.12, 0.005), (2, 2, 2)),
        ((0.1, np.nan, 0.005), (2, 2, 2)),
    ],
)
def test_impossible_boxes_are_refused(size_m, counts):
    with pytest.raises(BadMesh, match="give"):
        box_mesh(size_m, counts)


def test_damaged_meshes_are_refused():
    mesh = box_mesh((1.0, 1.0, 1.0), (2, 2, 2))
    with pytest.raises(BadMesh, match="belongs to no element"):
        Mesh(np.vstack([mesh.nodes_m, [[9.0, 9.0, 9.0]]]), mesh.elements, mesh.surface)
    with pytest.raises(BadMesh, match="outside"):
        Mesh(mesh.nodes_m[:-1], mesh.elements, mesh.surface)
    with pytest.raises(BadMesh, match="not finite"):
        Mesh(np.where(mesh.nodes_m == 1.0, np.inf, mesh.nodes_m), mesh.elements, mesh.surface)
    with pytest.raises(BadMesh, match="no element"):
        Mesh(mesh.nodes_m, mesh.elements[:0], mesh.surface)


def test_surface_of_two_elements_hides_the_shared_face():
    mesh = box_mesh((2.0, 1.0, 1.0), (3, 2, 2))
    assert len(surface_triangles(mesh.elements)) == 2 * 10
