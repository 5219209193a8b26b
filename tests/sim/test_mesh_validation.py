"""A mesh from elsewhere is sound or refused by name: properties over boxes of every cell."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fras_sim.fem import BadMesh, Cell
from fras_sim.fem.validation import (
    DegenerateElements,
    DisconnectedParts,
    DuplicateNodes,
    EmptyMesh,
    ImplausibleSize,
    InvertedElements,
    MalformedElements,
    NoVolumeElements,
    OverlappingElements,
    UnreferencedNodes,
    jacobian_determinants,
    validate_mesh,
)
from support.meshes import CELLS, box

cells = st.sampled_from(CELLS)
counts = st.tuples(*[st.integers(1, 3)] * 3)
seeds = st.integers(0, 2**32 - 1)
# Odd permutations that turn an element inside out and leave it well formed.
MIRRORED = {
    "hex8": [4, 5, 6, 7, 0, 1, 2, 3],
    "tet4": [1, 0, 2, 3],
    "tet10": [1, 0, 2, 3, 4, 6, 5, 8, 7, 9],
}


def assert_names(error: Any, bad: Any) -> None:
    assert error.count == len(bad)
    assert error.ids == sorted(bad)[:5]
    assert str(error).startswith(f"{len(bad)} of ")


@given(cells, counts, seeds)
@settings(deadline=None)
def test_a_distorted_and_shuffled_box_is_sound(cell: Cell, n: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    nodes_m, elements = box(cell, n)
    shortest_m = min(length / k for length, k in zip((0.1, 0.12, 0.005), n, strict=True))
    nodes_m = nodes_m + rng.uniform(-0.02, 0.02, nodes_m.shape) * shortest_m
    order = rng.permutation(len(nodes_m))
    place = np.argsort(order)
    validate_mesh(nodes_m[order], place[rng.permutation(elements)], cell)


@given(cells, counts, seeds, st.data())
@settings(deadline=None)
def test_inverted_elements_are_counted_and_named(cell: Cell, n: Any, seed: int, data: Any) -> None:
    nodes_m, elements = box(cell, n)
    bad = data.draw(st.sets(st.integers(0, len(elements) - 1), min_size=1))
    for one in bad:
        elements[one] = elements[one, MIRRORED[cell]]
    with pytest.raises(InvertedElements) as caught:
        validate_mesh(nodes_m, elements, cell)
    if len(bad) == len(elements):
        assert "mirrored" in str(caught.value)
    else:
        assert_names(caught.value, bad)


@given(cells, st.lists(counts, min_size=2, max_size=7))
@settings(deadline=None)
def test_parts_are_counted_with_their_sizes(cell: Cell, parts: list[Any]) -> None:
    nodes, elements, sizes, start = [], [], [], 0
    for shift, n in enumerate(parts):
        part_nodes, part_elements = box(cell, n, (0.1, 0.05, 0.005))
        nodes.append(part_nodes + np.array([0.0, 0.12 * shift, 0.0]))
        elements.append(part_elements + start)
        sizes.append(len(part_elements))
        start += len(part_nodes)
    with pytest.raises(DisconnectedParts) as caught:
        validate_mesh(np.concatenate(nodes), np.concatenate(elements), cell)
    assert caught.value.values == {"count": len(parts), "sizes": sorted(sizes, reverse=True)}


@given(cells, st.sampled_from([1e-3, 1e-2, 1e-6, 1e3, 1e2, 1e6]), st.floats(0.25, 4.0))
@settings(deadline=None)
def test_wrong_units_are_told_with_the_scale_that_mends_them(
    cell: Cell, unit: float, size: float
) -> None:
    nodes_m, elements = box(cell)
    applied = 7.0
    with pytest.raises(ImplausibleSize) as caught:
        validate_mesh(nodes_m * size / unit, elements, cell, applied)
    named: dict[str, Any] = caught.value.values
    assert named["longest_m"] == pytest.approx(0.12 * size / unit)
    mended = named["suggested_scale"] / applied * 0.12 * size / unit
    assert 0.02 <= mended <= 0.5


@pytest.mark.parametrize(
    ("longest_m", "words"),
    [
        (100.0, r"100 m long.*export in millimetres\? scale = 0\.001 makes it 0\.1 m"),
        (1e-4, r"0\.0001 m long.*twice\? scale = 1000 makes it 0\.1 m"),
        (12.0, r"centimetres\? scale = 0\.01 "),
        (1e20, r"check its units"),
    ],
)
def test_the_usual_mistakes_read_well(longest_m: float, words: str) -> None:
    nodes_m, elements = box("tet4")
    with pytest.raises(ImplausibleSize, match=words):
        validate_mesh(nodes_m * longest_m / 0.12, elements, "tet4")


@given(cells, st.integers(1, 9), seeds)
@settings(deadline=None)
def test_loose_nodes_are_counted_and_named(cell: Cell, extra: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    nodes_m, elements = box(cell)
    total = len(nodes_m) + extra
    kept = np.sort(rng.choice(total, len(nodes_m), replace=False))
    scattered = rng.uniform(0, 0.1, (total, 3))
    scattered[kept] = nodes_m
    with pytest.raises(UnreferencedNodes) as caught:
        validate_mesh(scattered, kept[elements], cell)
    assert_names(caught.value, set(range(total)) - set(kept.tolist()))


@given(cells, st.data())
@settings(deadline=None)
def test_a_seam_of_duplicate_nodes_is_named_before_the_parts_it_makes(
    cell: Cell, data: Any
) -> None:
    nodes_m, elements = box(cell, (2, 2, 2))
    node = data.draw(st.integers(0, len(nodes_m) - 1))
    of_node = np.flatnonzero((elements == node).any(axis=1))
    if len(of_node) == 1:
        nodes_m = np.concatenate([nodes_m, nodes_m])
        elements = np.concatenate([elements, elements + len(nodes_m) // 2])
        twins = set(range(len(nodes_m)))
    else:
        row = elements[of_node[0]]
        row[row == node] = len(nodes_m)
        nodes_m = np.concatenate([nodes_m, nodes_m[node : node + 1]])
        twins = {node, len(nodes_m) - 1}
    with pytest.raises(DuplicateNodes) as caught:
        validate_mesh(nodes_m, elements, cell)
    assert_names(caught.value, twins)


@given(cells, counts, st.data())
@settings(deadline=None)
def test_an_element_twice_is_an_overlap(cell: Cell, n: Any, data: Any) -> None:
    nodes_m, elements = box(cell, n)
    one = data.draw(st.integers(0, len(elements) - 1))
    with pytest.raises(OverlappingElements) as caught:
        validate_mesh(nodes_m, np.concatenate([elements, elements[one : one + 1]]), cell)
    assert one in caught.value.values["ids"] or caught.value.values["count"] > 5  # type: ignore[operator]


@pytest.mark.parametrize("cell", CELLS)
def test_a_squashed_body_and_a_collapsed_element_are_degenerate(cell: Cell) -> None:
    nodes_m, elements = box(cell, (1, 1, 1))
    with pytest.raises(DegenerateElements, match="without volume") as caught:
        validate_mesh(nodes_m * [1.0, 1.0, 1e-5], elements, cell)
    assert caught.value.values["count"] == len(elements)
    nodes_m, elements = box(cell)
    elements[3, 1] = elements[3, 0]
    with pytest.raises(DegenerateElements, match=r"1 of \d+ elements \(id 3\) naming a node twice"):
        validate_mesh(nodes_m, elements, cell)


def test_what_is_no_mesh_is_named() -> None:
    nodes_m, elements = box("tet4")
    with pytest.raises(NoVolumeElements, match="'triangle' cells: export volume elements"):
        validate_mesh(nodes_m, elements[:, :3], "triangle")
    with pytest.raises(EmptyMesh):
        validate_mesh(nodes_m, elements[:0], "tet4")
    with pytest.raises(EmptyMesh):
        validate_mesh(nodes_m[:0], elements, "tet4")
    with pytest.raises(MalformedElements, match="a hex8 has 8 nodes"):
        validate_mesh(nodes_m, elements, "hex8")
    with pytest.raises(MalformedElements, match="three coordinates"):
        validate_mesh(nodes_m[:, :2], elements, "tet4")
    for outside in (-1, len(nodes_m)):
        changed = elements.copy()
        changed[2, 0] = outside
        with pytest.raises(MalformedElements, match=r"\(id 2\) naming a node outside"):
            validate_mesh(nodes_m, changed, "tet4")
    nodes_m[5, 1] = np.nan
    with pytest.raises(MalformedElements, match=r"\(id 5\) with a coordinate"):
        validate_mesh(nodes_m, elements, "tet4")


def test_a_bent_tet10_fails_at_the_node_where_it_folds() -> None:
    nodes_m, elements = box("tet10", (1, 1, 1), (0.05, 0.05, 0.05))
    corner, middle = nodes_m[elements[0, 0]], elements[0, 4]
    nodes_m[middle] = corner + 0.2 * (nodes_m[elements[0, 1]] - corner)
    with pytest.raises(InvertedElements):
        validate_mesh(nodes_m, elements, "tet10")


@pytest.mark.parametrize("cell", CELLS)
def test_determinants_are_volumes_over_parent_volumes(cell: Cell) -> None:
    nodes_m, elements = box(cell, (1, 1, 1), (0.1, 0.12, 0.005))
    determinants = jacobian_determinants(nodes_m, elements, cell)
    parent = {"hex8": 8.0, "tet4": 1.0 / 6.0, "tet10": 1.0 / 6.0}[cell]
    volume = 0.1 * 0.12 * 0.005 / len(elements)
    assert determinants == pytest.approx(np.full(determinants.shape, volume / parent))


@given(st.binary(max_size=200), cells)
@settings(deadline=None)
def test_noise_is_refused_with_a_typed_error(noise: bytes, cell: Cell) -> None:
    numbers = np.frombuffer(noise[: len(noise) // 8 * 8], dtype=np.int64)
    width = {"hex8": 8, "tet4": 4, "tet10": 10}[cell]
    elements = (
        np.resize(numbers, (max(1, len(numbers) // width), width))
        if len(numbers)
        else (np.zeros((0, width), dtype=np.int64))
    )
    with pytest.raises(BadMesh):
        validate_mesh(np.random.default_rng(0).uniform(0, 0.1, (4, 3)), elements, cell)
