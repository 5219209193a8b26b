"""The blocks: a partition of the tissue, each bound to its material point."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fras_sa.awareness import (
    Awareness,
    AwarenessParameters,
    NoBlocks,
    UnknownName,
    make_blocks,
)


@given(n=st.integers(1, 20), flip=st.booleans())
def test_rest_centres_and_names_follow_the_design(box, n, flip):
    blocks = make_blocks(box((11, 13, 2), flip=flip), n)
    assert len(blocks) == n * n
    for i, j in itertools.product(range(1, n + 1), repeat=2):
        row = (i - 1) * n + j - 1
        assert blocks.names[row] == f"b({i},{j})"
        assert blocks.row(f"b({i},{j})") == row
        expected = ((i - 0.5) * 0.1 / n, (j - 0.5) * 0.12 / n, 0.005)
        np.testing.assert_allclose(blocks.rest_m[row], expected, rtol=0, atol=1e-12)


@given(n=st.integers(1, 12), x=st.floats(0, 0.1), y=st.floats(0, 0.12))
def test_each_point_of_the_tissue_lies_in_exactly_one_cell(box, n, x, y):
    blocks = make_blocks(box(), n)
    row = blocks.rows_at(np.array([[x, y, 0.0]]))[0]
    offset = np.abs(blocks.rest_m[row, :2] - (x, y))
    assert np.all(offset <= np.array([0.05, 0.06]) / n + 2e-7)


@given(
    n=st.integers(1, 12),
    matrix=st.lists(st.floats(-2, 2), min_size=9, max_size=9),
    shift=st.lists(st.floats(-1, 1), min_size=3, max_size=3),
)
def test_blocks_follow_an_affine_motion_exactly(box, n, matrix, shift):
    model = box((5, 7, 3))
    blocks = make_blocks(model, n)
    A, c = np.array(matrix).reshape(3, 3), np.array(shift)
    np.testing.assert_allclose(
        blocks.current(model.nodes_m @ A.T + c), blocks.rest_m @ A.T + c, rtol=0, atol=1e-12
    )


@pytest.mark.parametrize("n", [2, 4, 5, 8, 10, 20, 40])
def test_a_point_on_an_edge_belongs_to_the_upper_cell_even_from_float32(box, n):
    model = box()
    single = dataclasses.replace(model, nodes_m=model.nodes_m.astype(np.float32))
    for scene in (model, single):
        blocks = make_blocks(scene, n)
        for k in range(n):
            edge = np.array([[k * 0.1 / n, k * 0.12 / n, 0.0]])
            for points in (edge, edge.astype(np.float32)):
                assert blocks.names[blocks.rows_at(points)[0]] == f"b({k + 1},{k + 1})"


def test_the_last_cells_are_closed_and_nothing_lies_outside(box):
    blocks = make_blocks(box(), 7)
    points = np.array([[0.1, 0.12, 0], [0, 0, 0], [0.1001, 0.06, 0], [0.05, -0.0001, 0]])
    rows = blocks.rows_at(points)
    assert [blocks.names[row] for row in rows[:2]] == ["b(7,7)", "b(1,1)"]
    assert list(rows[2:]) == [-1, -1]


def test_a_grid_follows_the_bounding_box_wherever_the_tissue_lies(box):
    shift = np.array([-0.3, 0.2, 0.07])
    there = make_blocks(box(origin=shift), 7)
    np.testing.assert_allclose(there.rest_m, make_blocks(box(), 7).rest_m + shift, atol=1e-12)
    assert there.middle_y_m == pytest.approx(0.26, abs=1e-12)


def test_cells_without_surface_are_dropped_and_rows_close_up(box):
    model = box((11, 13, 2))
    centroids = model.nodes_m[model.triangles].mean(axis=1)
    hole = (centroids[:, 0] > 0.06) & (centroids[:, 1] < 0.04)
    cut = dataclasses.replace(model, triangles=model.triangles[~hole])
    blocks = make_blocks(cut, 5)
    dropped = {f"b({i},{j})" for i in (4, 5) for j in (1, 2)}
    assert set(make_blocks(model, 5).names) - set(blocks.names) == dropped
    assert blocks.row("b(4,3)") == 3 * 5 - 0
    assert blocks.rows_at(np.array([[0.07, 0.01, 0.0]]))[0] == -1
    np.testing.assert_allclose(blocks.current(model.nodes_m), blocks.rest_m, atol=1e-12)


def test_height_is_that_of_a_curved_top_face(box):
    model = box((21, 25, 2))
    nodes = model.nodes_m.copy()
    nodes[:, 2] += 0.2 * nodes[:, 0] + 0.1 * nodes[:, 1]
    slanted = dataclasses.replace(model, nodes_m=nodes)
    blocks = make_blocks(slanted, 6)
    x, y, z = blocks.rest_m.T
    np.testing.assert_allclose(z, 0.005 + 0.2 * x + 0.1 * y, atol=1e-12)


def test_an_unknown_block_is_named(box):
    with pytest.raises(UnknownName, match=r"unknown block 'b\(8,1\)'") as error:
        make_blocks(box(), 7).row("b(8,1)")
    assert error.value.values["name"] == "b(8,1)"


def test_a_tissue_without_any_block_is_refused(box):
    model = box((11, 13, 2))
    centroids = model.nodes_m[model.triangles].mean(axis=1)
    ring = np.abs(centroids[:, :2] - (0.05, 0.06)).max(axis=1) > 0.03
    hollow = dataclasses.replace(
        model, triangles=model.triangles[ring], roi_m=np.array([0.01, 0.01, 0.0])
    )
    with pytest.raises(NoBlocks):
        Awareness(AwarenessParameters(blocks=1), hollow)
