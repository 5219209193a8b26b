import ctypes
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from fras_sim.fem import BadParameter, FactorizationFailed, box_mesh
from fras_sim.fem.assembly import ElasticBody, sparsity_pattern
from fras_sim.fem.linear import mkl_library, ordering
from fras_sim.fem.linear.mkl_library import SolverUnavailable, has_mkl
from fras_sim.fem.linear_solver import SOLVERS, linear_solver

NEEDS_MKL = pytest.mark.skipif(not has_mkl(), reason="the extra mkl is not installed")
DOUBLE = ["scipy", pytest.param("mkl", marks=NEEDS_MKL)]
SINGLE = ["scipy-single", pytest.param("mkl-single", marks=NEEDS_MKL)]


def body_of(counts=(7, 9, 2), size_m=(0.1, 0.12, 0.005)):
    mesh = box_mesh(size_m, counts)
    fixed = mesh.bottom_nodes[: int(0.4 * len(mesh.bottom_nodes))]
    return ElasticBody(mesh, 3000.0, 0.45, "hex8-sri", fixed)


def stiffness(body):
    """A Hessian as a step has it, with inertia on the diagonal."""
    values = body.hessian(body.mesh.nodes_m)
    values[body.pattern.diagonal] += 0.05
    return values


def shuffled(mesh, seed=0):
    """The elements of a mesh whose nodes have been given new numbers."""
    number = np.random.default_rng(seed).permutation(len(mesh.nodes_m))
    return number[mesh.elements].astype(np.int32)


def dense(pattern, values):
    matrix = np.zeros((pattern.n, pattern.n))
    matrix[pattern.rows, pattern.indices] = values
    return matrix + np.triu(matrix, 1).T


def random_spd(pattern, seed=0):
    """Diagonally dominant entries for any pattern."""
    values = np.random.default_rng(seed).uniform(-1.0, 1.0, pattern.n_entries)
    values[pattern.diagonal] = 0.0
    values[pattern.diagonal] = 1.0 + np.abs(dense(pattern, values)).sum(axis=1)
    return values


@pytest.fixture(params=[False, True], ids=["from-one-end", "from-both-ends"])
def both_ends(request, monkeypatch):
    """The banded solver as small bodies have it, and as large ones."""
    limit = 0 if request.param else np.inf
    monkeypatch.setattr("fras_sim.fem.linear.banded.WORTH_SPLITTING", limit)
    monkeypatch.setattr("fras_sim.fem.linear.banded.WORTH_SHARING", limit)


@pytest.mark.usefixtures("both_ends")
@pytest.mark.parametrize("name", DOUBLE)
@pytest.mark.parametrize("counts", [(2, 2, 2), (3, 2, 3), (7, 9, 2), (12, 5, 3), (5, 30, 2)])
def test_it_solves(name, counts):
    body = body_of(counts)
    solver = linear_solver(name, body.pattern)
    assert solver.name == name
    rhs = np.random.default_rng(0).standard_normal(body.pattern.n)
    for scale in (1.0, 2.0):
        values = scale * stiffness(body)
        solver.factorize(values)
        x = solver.solve(rhs)
        exact = np.linalg.solve(dense(body.pattern, values), rhs)
        np.testing.assert_allclose(x, exact, atol=1e-11 * np.abs(exact).max())
        np.testing.assert_array_equal(solver.solve(rhs), x)


@pytest.mark.parametrize("name", SINGLE)
def test_single_precision_is_close(name):
    body = body_of()
    solver = linear_solver(name, body.pattern)
    values = stiffness(body)
    solver.factorize(values)
    rhs = np.random.default_rng(0).standard_normal(body.pattern.n)
    exact = np.linalg.solve(dense(body.pattern, values), rhs)
    error = np.abs(solver.solve(rhs) - exact).max() / np.abs(exact).max()
    assert 1e-9 < error < 1e-3
    assert solver.name == name


@pytest.mark.parametrize("name", SINGLE)
def test_what_single_precision_can_not_factor_double_does(name):
    pattern = body_of((3, 3, 2)).pattern
    values = random_spd(pattern)
    # Two equal rows but for a difference that float32 rounds away.
    a, b = 0, int(np.flatnonzero(pattern.rows == 0)[1])
    column = pattern.indices[b]
    values[(pattern.rows == column) | (pattern.indices == column) | (pattern.rows == 0)] = 0.0
    values[a], values[b] = 1.0, 1.0
    values[pattern.diagonal[column]] = 1.0 + 1e-10
    solver = linear_solver(name, pattern)
    rhs = np.ones(pattern.n)
    rhs[column] = 1.0 + 1e-10
    solver.factorize(values)
    x = solver.solve(rhs)
    np.testing.assert_allclose([x[0], x[column]], [0.0, 1.0], atol=1e-4)
    solver.factorize(random_spd(pattern))
    again = linear_solver(name, pattern)
    again.factorize(random_spd(pattern))
    np.testing.assert_array_equal(solver.solve(rhs), again.solve(rhs))


@pytest.mark.usefixtures("both_ends")
@pytest.mark.parametrize("name", [*DOUBLE, *SINGLE])
def test_an_indefinite_matrix_is_refused_with_its_row(name):
    body = body_of()
    values = body.hessian(body.mesh.nodes_m)
    solver = linear_solver(name, body.pattern)
    for row in (17, body.pattern.n // 2, body.pattern.n - 18):
        broken = values.copy()
        broken[body.pattern.diagonal[row]] = -1.0
        with pytest.raises(FactorizationFailed, match="not positive definite at row") as caught:
            solver.factorize(broken)
        assert caught.value.values["row"] in range(body.pattern.n)
        if name.startswith("scipy"):  # the first to fail, in whichever order it is eliminated
            assert caught.value.values["row"] == row
    solver.factorize(values)
    assert np.isfinite(solver.solve(np.ones(body.pattern.n))).all()


@pytest.mark.usefixtures("both_ends")
@pytest.mark.parametrize("name", [*DOUBLE, *SINGLE])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_entries_that_are_not_finite_are_refused(name, value):
    body = body_of()
    solver = linear_solver(name, body.pattern)
    for entry in (0, body.pattern.n_entries // 2, body.pattern.n_entries - 1):
        values = body.hessian(body.mesh.nodes_m)
        values[entry] = value
        with pytest.raises(FactorizationFailed):
            solver.factorize(values)


BITS = """
import hashlib, sys
import numpy as np
from fras_sim.fem.assembly import sparsity_pattern
from fras_sim.fem import box_mesh
from fras_sim.fem.linear_solver import linear_solver

def digest(name, offset=0):
    kept = np.zeros(offset)  # moves what is allocated next
    mesh = box_mesh((0.1, 0.12, 0.005), (9, 11, 3))
    pattern = sparsity_pattern(mesh.elements, len(mesh.nodes_m), mesh.bottom_nodes[:30])
    rng = np.random.default_rng(5)
    values = rng.uniform(-0.1, 0.1, pattern.n_entries)
    values[pattern.diagonal] = 9.0
    solver = linear_solver(name, pattern)
    solver.factorize(values)
    return hashlib.sha256(solver.solve(rng.standard_normal(pattern.n))).hexdigest()
"""


@pytest.mark.parametrize("name", [*DOUBLE, *SINGLE])
def test_the_same_bits_in_every_solver_and_process(name):
    here: dict[str, Any] = {}
    exec(BITS, here)
    digest = here["digest"]
    own = {digest(name, offset) for offset in (0, 1, 3, 1_000, 100_001)}
    code = BITS + "np.ones(12345)\nprint(digest(sys.argv[1], 7))"
    run = subprocess.run([sys.executable, "-c", code, name], capture_output=True, check=True)
    assert own == {run.stdout.decode().strip()}


def test_a_box_numbered_by_slices_stays_as_it_is():
    pattern = body_of((7, 9, 2)).pattern
    np.testing.assert_array_equal(ordering.narrow_order(pattern), np.arange(pattern.n))


@pytest.mark.parametrize("counts", [(25, 5, 2), (5, 25, 3), (3, 4, 20)])
@pytest.mark.parametrize("renumber", [False, True])
def test_any_numbering_costs_about_as_little_as_slices_along_the_longest_side(counts, renumber):
    mesh = box_mesh(node_counts=counts)
    elements = shuffled(mesh) if renumber else mesh.elements
    none_fixed = np.zeros(0, dtype=np.int32)
    pattern = sparsity_pattern(elements, len(mesh.nodes_m), none_fixed)
    order = ordering.narrow_order(pattern)
    np.testing.assert_array_equal(np.sort(order), np.arange(pattern.n))
    slice_rows = 3 * np.prod(sorted(counts)[:2])
    assert ordering.envelope_cost(pattern, order) <= pattern.n * (2.0 * slice_rows) ** 2


@pytest.mark.usefixtures("both_ends")
@pytest.mark.parametrize("name", DOUBLE)
def test_numbering_does_not_change_the_solution(name):
    mesh = box_mesh(node_counts=(9, 4, 2))
    pattern = sparsity_pattern(shuffled(mesh), len(mesh.nodes_m), np.arange(5, dtype=np.int32))
    values = random_spd(pattern)
    solver = linear_solver(name, pattern)
    solver.factorize(values)
    rhs = np.random.default_rng(1).standard_normal(pattern.n)
    exact = np.linalg.solve(dense(pattern, values), rhs)
    np.testing.assert_allclose(solver.solve(rhs), exact, atol=1e-14)


@pytest.mark.usefixtures("both_ends")
@pytest.mark.parametrize("name", DOUBLE)
def test_a_body_in_parts(name):
    """Fixed nodes may cut what is free into pieces, down to a single node."""
    mesh = box_mesh(node_counts=(2, 7, 2))
    fixed = np.flatnonzero(np.isin(mesh.nodes_m[:, 1], mesh.nodes_m[[8, 20], 1])).astype(np.int32)
    pattern = sparsity_pattern(mesh.elements, len(mesh.nodes_m), fixed)
    values = random_spd(pattern)
    solver = linear_solver(name, pattern)
    solver.factorize(values)
    rhs = np.random.default_rng(1).standard_normal(pattern.n)
    exact = np.linalg.solve(dense(pattern, values), rhs)
    np.testing.assert_allclose(solver.solve(rhs), exact, atol=1e-14)


def test_a_single_column_of_nodes_is_an_order_too():
    no_edge = np.zeros(0, dtype=np.int64)
    np.testing.assert_array_equal(ordering.level_order(3, no_edge, no_edge), [0, 1, 2])


def test_auto_takes_mkl_for_wide_bodies_only(monkeypatch):
    pattern = body_of((3, 3, 2)).pattern
    assert linear_solver("auto", pattern).name == "scipy-single"
    monkeypatch.setattr("fras_sim.fem.linear_solver.WIDE", 0)
    expected = "mkl-single" if has_mkl() else "scipy-single"
    assert linear_solver("auto", pattern).name == expected
    monkeypatch.setattr("fras_sim.fem.linear_solver.has_mkl", lambda: False)
    assert linear_solver("auto", pattern).name == "scipy-single"


def test_an_unknown_solver_is_named_with_the_known_ones():
    with pytest.raises(BadParameter, match="auto, mkl, mkl-single, scipy") as caught:
        linear_solver("abacus", body_of((3, 3, 2)).pattern)
    assert all(name in str(caught.value) for name in SOLVERS)


def test_missing_mkl_is_explained(monkeypatch):
    monkeypatch.setattr(mkl_library, "_from_wheel", lambda: [])
    monkeypatch.setattr(mkl_library, "LIBRARY_NAMES", ("no_such_library.so",))
    mkl_library.mkl_library.cache_clear()
    try:
        assert not has_mkl()
        with pytest.raises(SolverUnavailable, match=r"pip install 'fras\[mkl\]'"):
            linear_solver("mkl", body_of((3, 3, 2)).pattern)
    finally:
        mkl_library.mkl_library.cache_clear()


@NEEDS_MKL
def test_mkl_gives_its_memory_back():
    library = mkl_library.mkl_library()
    library.MKL_Mem_Stat.restype = ctypes.c_int64
    buffers = ctypes.c_int(0)
    pattern = body_of().pattern

    def in_use():
        library.MKL_Free_Buffers()
        return library.MKL_Mem_Stat(ctypes.byref(buffers))

    def use():
        solver = linear_solver("mkl", pattern)
        solver.factorize(random_spd(pattern))
        return solver, in_use()

    use()
    before = in_use()
    solver, while_it_lives = use()
    del solver
    assert in_use() == before < while_it_lives
