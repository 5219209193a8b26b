"""Elements by sixteens: padding adds nothing, congruent ones share their gradients."""

import numpy as np
import pytest

from fras_sim.fem import box_mesh, make_mesh
from fras_sim.fem.assembly import ElasticBody
from fras_sim.fem.batches import LANES, make_batches
from fras_sim.fem.element import quadrature

NONE = np.zeros(0, dtype=np.int32)


def moved(mesh, seed=0):
    rng = np.random.default_rng(seed)
    return mesh.nodes_m + rng.normal(0.0, 0.05 * mesh.spacing_m, mesh.nodes_m.shape)


@pytest.mark.parametrize("count", [1, LANES - 1, LANES, LANES + 1, 3 * LANES + 5])
def test_any_number_of_elements_is_the_sum_of_each_alone(count):
    mesh = box_mesh((0.01 * count, 0.01, 0.01), (count + 1, 2, 2))
    x = moved(mesh)
    body = ElasticBody(mesh, 3000.0, 0.45, "hex8-sri", NONE)
    force = np.zeros_like(x)
    energy = body.energy_gradient(x, force)
    expected_force, expected = np.zeros_like(x), 0.0
    hessian = np.zeros((x.size, x.size))
    for element in mesh.elements:
        one = make_mesh(mesh.nodes_m[element], np.arange(8)[None], "hex8")
        alone = ElasticBody(one, 3000.0, 0.45, "hex8-sri", NONE)
        part = np.zeros((8, 3))
        expected += alone.energy_gradient(x[element], part)
        expected_force[element] += part
        rows = (3 * element[:, None] + np.arange(3)).ravel()
        block = np.zeros((24, 24))
        block[alone.pattern.rows, alone.pattern.indices] = alone.hessian(x[element])
        hessian[np.ix_(rows, rows)] += block + np.triu(block, 1).T
    assert energy == pytest.approx(expected, rel=1e-12)
    np.testing.assert_allclose(force, expected_force, atol=1e-12 * np.abs(force).max())
    values = body.hessian(x)
    exact = hessian[body.pattern.rows, body.pattern.indices]
    np.testing.assert_allclose(values, exact, atol=1e-12 * np.abs(exact).max())


def test_a_box_needs_one_set_of_gradients_and_a_crooked_mesh_one_a_batch():
    mesh = box_mesh(node_counts=(9, 9, 3))
    batches = make_batches(mesh.elements, quadrature(mesh))
    assert len(batches.gradients) == 1
    assert len(batches.set_of) == len(mesh.elements) // LANES
    crooked = make_mesh(moved(mesh), mesh.elements, "hex8")
    batches = make_batches(crooked.elements, quadrature(crooked))
    assert len(batches.gradients) == len(batches.set_of)
    np.testing.assert_array_equal(np.moveaxis(batches.by_element, 1, -1), batches.gradients)
