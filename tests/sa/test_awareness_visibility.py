"""Visibility: what hides the ROI, by area, whatever the mesh."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fras_sa.awareness import NoTissueNearRoi, TissueModel, make_close_points

MESHES = [(11, 13, 2), (21, 25, 2), (21, 25, 3)]


def lifted(nodes, at, height, width):
    """A tent as a pull makes it: lifted at a point, tapering off."""
    distance = np.linalg.norm(nodes[:, :2] - at, axis=1)
    moved = nodes.copy()
    moved[:, 2] += height / np.cosh(distance / width)
    return moved


def close(model, edge=0.00125):
    return make_close_points(model, 0.01, edge)


@given(x=st.floats(0.015, 0.085), y=st.floats(0.015, 0.105))
@example(x=0.06633217, y=0.06633217)
@example(x=0.05, y=0.06)
def test_at_rest_nothing_is_visible_and_the_area_is_that_of_two_discs(box, x, y):
    model = box((21, 25, 2), roi=(x, y, 0.0))
    points = make_close_points(model, 0.01, 0.00125)
    assert points.visible_fraction(model.nodes_m) == 0.0
    assert points.visible_fraction(model.nodes_m.astype(np.float32)) == 0.0
    assert points.weights.sum() == pytest.approx(1.0, abs=1e-12)
    # Lower disc of radius 10 mm, upper of sqrt(10^2 - 5^2).
    z = points.barycentric * model.nodes_m[points.corners, 2]
    lower = points.weights[z.sum(axis=0) < 0.0025].sum()
    assert lower == pytest.approx(100 / (100 + 75), abs=0.01)


def test_all_is_visible_when_the_tissue_is_away(box):
    model = box()
    assert close(model).visible_fraction(model.nodes_m + np.array([0, 0, 0.02])) == 1.0


def test_a_known_shift_uncovers_the_area_of_geometry(box):
    # Lifted by d, the lower face shows all but a disc of radius sqrt(R^2 - d^2).
    model = box((21, 25, 2))
    for lift in (0.002, 0.004):
        hidden = (0.01**2 - lift**2) + max(0.0, 0.01**2 - (0.005 + lift) ** 2)
        fraction = close(model).visible_fraction(model.nodes_m + np.array([0, 0, lift]))
        assert fraction == pytest.approx(1 - hidden / (0.01**2 + 0.01**2 - 0.005**2), abs=0.01)


def test_a_roi_below_the_tissue_is_hidden_by_less(box):
    shallow, deep = close(box(roi=(0.05, 0.06, 0.0))), close(box(roi=(0.05, 0.06, -0.008)))
    assert 0 < deep.weights.size < shallow.weights.size


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize(("given_by", "narrowest"), [("shape", 0.02), ("field", 0.04)])
def test_meshes_agree_within_two_points_of_percentage(box, given_by, narrowest, flip):
    # Either all meshes take the coarse one's shape, or each samples the same smooth field. What
    # a 10 mm mesh can't resolve (narrower fields) it shows as another shape, by up to 3 points.
    rng = np.random.default_rng(5)
    partly = 0
    for _ in range(120):
        x, y = rng.uniform((0.015, 0.015), (0.085, 0.105))
        tent = {
            "at": rng.normal((x, y), 0.01),
            "height": rng.uniform(0, 0.04),
            "width": rng.uniform(narrowest, 0.08),
        }
        coarse = box(MESHES[0], roi=(x, y, 0.0))
        lift = lifted(coarse.nodes_m, **tent)[:, 2] - coarse.nodes_m[:, 2]
        table = lift.reshape(MESHES[0])[:, :, 0]
        fractions: list[float] = []
        for counts in MESHES:
            model = box(counts, roi=(x, y, 0.0), flip=flip and counts != MESHES[0])
            moved = lifted(model.nodes_m, **tent)
            if given_by == "shape":
                height = on_coarse_triangles(table, model.nodes_m[:, :2])
                moved[:, 2] = model.nodes_m[:, 2] + height
            fractions.append(close(model).visible_fraction(moved))
        assert max(fractions) - min(fractions) <= 0.02
        partly += 0.02 < fractions[0] < 0.98
    assert partly >= 25


def on_coarse_triangles(table, xy):
    """Interpolate on the 10 mm grid's triangles, whose diagonals run from (0,0) to (1,1)."""
    scaled = xy / 0.01
    cell = np.clip(np.floor(scaled + 1e-9).astype(int), 0, np.array(table.shape) - 2)
    u, v = (scaled - cell).T
    i, j = cell.T
    a, b, c, d = table[i, j], table[i + 1, j], table[i + 1, j + 1], table[i, j + 1]
    return np.where(u >= v, a + u * (b - a) + v * (c - b), a + u * (c - d) + v * (d - a))


def test_sampling_is_fine_enough_and_converges(box):
    errors = {}
    for edge in (0.005, 0.00125):
        worst = 0.0
        for lift in np.linspace(0.001, 0.009, 9):
            model = box((21, 25, 2), roi=(0.0513, 0.0607, 0.0))
            moved = model.nodes_m + np.array([0, 0, lift])
            truth = close(model, 0.0002).visible_fraction(moved)
            worst = max(worst, abs(close(model, edge).visible_fraction(moved) - truth))
        errors[edge] = worst
    assert errors[0.00125] <= 0.01
    assert errors[0.00125] < 0.5 * errors[0.005]


def test_a_mesh_of_uneven_triangles_is_sampled_evenly():
    # One side of the square is one triangle, the other many: each must count by its area.
    n = 16
    line = np.linspace(0.0, 0.01, n + 1)
    nodes = np.array([[0, 0, 0], *[[x, 0.01 - x, 0] for x in line], [0.01, 0.01, 0]])
    fan = [[0, k, k + 1] for k in range(1, n + 1)]
    model = TissueModel(
        nodes - (0.005, 0.005, 0),
        np.array([*fan, [1, n + 1, n + 2]]),
        np.empty((0, 3)),
        np.zeros(3),
        dt_s=0.02,
    )
    points = make_close_points(model, 0.02, 0.001)
    in_fan = np.any(points.corners == 0, axis=0)
    assert points.weights[in_fan].sum() == pytest.approx(0.5, abs=1e-12)
    longest = math.sqrt(2) * 0.01
    assert (~in_fan).sum() >= (longest / 0.001) ** 2


def test_no_tissue_near_the_roi_is_refused_with_the_place(box):
    with pytest.raises(NoTissueNearRoi) as error:
        close(box(roi=(0.05, 0.06, -0.011)))
    assert error.value.values["roi_m"] == (0.05, 0.06, -0.011)
    assert error.value.values["distance_m"] == 0.01
