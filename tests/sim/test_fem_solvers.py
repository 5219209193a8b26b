import sys

import numpy as np
import pytest

from fras_sim.fem import (
    TissueParameters,
    TissueSimulator,
    ToolInput,
    box_mesh,
    compile_kernels,
    kernels,
)
from fras_sim.fem.assembly import ElasticBody
from fras_sim.fem.healing import heal
from fras_sim.fem.lbfgs import LbfgsMemory
from fras_sim.fem.linear_solver import linear_solver
from fras_sim.fem.pattern import IdentityRows


def body_of(counts=(7, 9, 2), fixed_share=0.4):
    mesh = box_mesh(node_counts=counts)
    fixed = mesh.bottom_nodes[: int(fixed_share * len(mesh.bottom_nodes))]
    return ElasticBody(mesh, 3000.0, 0.45, "hex8-sri", fixed)


def dense(body, values):
    matrix = np.zeros((body.pattern.n, body.pattern.n))
    matrix[body.pattern.rows, body.pattern.indices] = values
    return matrix + np.triu(matrix, 1).T


def test_symmetric_product_and_identity_rows():
    body = body_of((4, 4, 2))
    pattern = body.pattern
    values = body.hessian(body.mesh.nodes_m)
    vector = np.random.default_rng(1).standard_normal(pattern.n)
    product = kernels.symmetric_product(pattern.indptr, pattern.indices, values, vector)
    matrix = dense(body, values)
    np.testing.assert_allclose(product, matrix @ vector, atol=1e-10)
    rows = np.array([2, 5], dtype=np.int32)
    matrix[rows], matrix[:, rows] = 0.0, 0.0
    matrix[rows, rows] = 1.0
    np.testing.assert_array_equal(dense(body, IdentityRows(pattern, rows).put_into(values)), matrix)


def test_lbfgs_learns_a_quadratic():
    rng = np.random.default_rng(2)
    root = rng.standard_normal((6, 6))
    matrix = root @ root.T + np.eye(6)
    memory = LbfgsMemory(history=6, n=6)
    x = rng.standard_normal(6)
    for _ in range(40):
        gradient = matrix @ x
        way = memory.direction(gradient, lambda q: q.copy())
        assert way @ gradient <= 0.0
        step = -(way @ gradient) / (way @ matrix @ way) * way
        memory.add(step, matrix @ step)
        x = x + step
        if np.linalg.norm(matrix @ x) < 1e-10:
            break
    assert np.linalg.norm(matrix @ x) < 1e-10


def test_lbfgs_ignores_pairs_without_curvature():
    memory = LbfgsMemory(history=3, n=2)
    memory.add(np.ones(2), -np.ones(2))
    np.testing.assert_array_equal(memory.direction(np.ones(2), lambda q: q.copy()), -np.ones(2))


@pytest.mark.parametrize("fixed_share", [0.4, 0.0])
def test_healing_unfolds_what_is_inverted(fixed_share):
    body = body_of(fixed_share=fixed_share)
    rest = body.mesh.nodes_m
    top = np.setdiff1d(np.arange(len(rest)), body.mesh.bottom_nodes)
    x = rest.copy()
    x[top[20:28], 2] = -0.004
    assert len(body.strain(x)[1])
    healed, moved = heal(body, linear_solver("scipy", body.pattern), x)
    assert len(body.strain(healed)[1]) == 0
    untouched = np.setdiff1d(np.arange(len(rest)), moved)
    np.testing.assert_array_equal(healed[untouched], x[untouched])
    assert set(top[20:28]) <= set(moved)


def test_healing_leaves_a_healthy_body_alone():
    body = body_of()
    x = body.mesh.nodes_m * [1.2, 1.0, 1.0]
    healed, moved = heal(body, linear_solver("scipy", body.pattern), x)
    assert healed is x
    assert len(moved) == 0


def test_healing_a_crumpled_body_ends_at_rest():
    body = body_of()
    rest = body.mesh.nodes_m
    crumpled = np.where(rest[:, 2:] > 0, rest * [1, 1, -3], rest)
    healed, _ = heal(body, linear_solver("scipy", body.pattern), crumpled)
    np.testing.assert_allclose(healed, rest, atol=1e-12)


def compiled():
    """Every signature of every kernel in the package."""
    return {
        (name, key): len(value.signatures)
        for name, module in list(sys.modules.items())
        if name.startswith("fras_sim.fem")
        for key, value in vars(module).items()
        if hasattr(value, "signatures")
    }


def test_no_kernel_is_compiled_after_the_warm_up():
    compile_kernels()
    before = compiled()
    assert sum(before.values()) > 3
    mesh = box_mesh(node_counts=(4, 5, 2))
    tissue = TissueSimulator(mesh, TissueParameters(), mesh.bottom_nodes[:4])
    tip_m = np.array([0.05, 0.06, 0.005])
    for jaw, lift_m in ((1.0, 0.0), (-0.3, 0.0), (-0.3, 0.004), (1.0, 0.004)):
        tissue.step({"psm1": ToolInput(tip_m + np.array([0.0, 0.0, lift_m]), jaw)})
    assert compiled() == before
