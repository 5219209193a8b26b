"""Where the underside of a body is, seen from above."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fras_cli.options import build_trial
from fras_sim.adapter import build_simulator, tissue_model
from fras_sim.fem import Cell, make_mesh
from fras_sim.fem import underside as module
from fras_sim.fem.underside import underside_height
from support.meshes import CELLS, box


@given(
    cell=st.sampled_from(CELLS),
    slopes=st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)),
    place=st.tuples(st.floats(-0.02, 0.12), st.floats(-0.02, 0.14)),
)
def test_a_tilted_box_has_a_tilted_underside(cell: Cell, slopes: Any, place: Any) -> None:
    nodes_m, elements = box(cell)
    nodes_m[:, 2] += nodes_m[:, :2] @ slopes
    (height,) = underside_height(make_mesh(nodes_m, elements, cell), np.array([place]))
    inside = 0 <= place[0] <= 0.1 and 0 <= place[1] <= 0.12
    beside = max(-place[0], place[0] - 0.1, -place[1], place[1] - 0.12)
    if inside:
        assert height == pytest.approx(np.dot(place, slopes), abs=1e-12)
    elif beside > 1e-9:
        assert np.isnan(height)


def test_many_places_are_looked_at_piece_by_piece(monkeypatch: pytest.MonkeyPatch) -> None:
    nodes_m, elements = box("tet4")
    nodes_m[:, 2] += nodes_m[:, 0] ** 2
    mesh = make_mesh(nodes_m, elements, "tet4")
    places = np.random.default_rng(0).uniform(-0.01, 0.13, (300, 2))
    at_once = underside_height(mesh, places)
    monkeypatch.setattr(module, "CHUNK", 1000)
    np.testing.assert_array_equal(underside_height(mesh, places), at_once)
    assert 0 < np.isnan(at_once).sum() < 300


def test_attachment_points_lie_on_the_slab_and_nowhere_beside_it() -> None:
    trial = build_trial("slab", seed=3)
    simulator = build_simulator(trial.scenario, trial.mesh)
    points = tissue_model(simulator, trial.scenario, "t").fixed_points_m.floats()
    assert points[:, 2].max() > 0.002
    assert points[:, 2].min() >= 0.0
    # Each lies near a node of the underside, and between the heights of those around it.
    nodes = simulator.mesh.nodes_m[simulator.mesh.bottom_nodes]
    apart = np.linalg.norm(points[:, None] - nodes, axis=2).min(axis=1)
    assert apart.max() < simulator.mesh.spacing_m


def test_attachment_points_of_a_box_stay_on_its_raster() -> None:
    trial = build_trial("a")
    simulator = build_simulator(trial.scenario, trial.mesh)
    points = tissue_model(simulator, trial.scenario, "t").fixed_points_m.floats()
    assert len(points) == round(0.4 * 40 * 48)
    assert (points[:, 2] == 0.0).all()
