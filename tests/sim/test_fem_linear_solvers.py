import ctypes
import dataclasses
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from fras_sim.fem import BadParameter, FactorizationFailed, box_mesh
from fras_sim.fem.assembly import ElasticBody
from fras_sim.fem.linear import dissection, mkl_library
from fras_sim.fem.linear.mkl_library import SolverUnavailable, has_mkl
from fras_sim.fem.linear_solver import SOLVERS, linear_solver
from fras_sim.fem.pattern import sparsity_pattern

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


def assert_solves(name, pattern, rhs):
    """Refuse a solver that does not solve a random system as a dense one does."""
    values = random_spd(pattern)
    solver = linear_solver(name, pattern)
    solver.factorize(values)
    exact = np.linalg.solve(dense(pattern, values), rhs)
    np.testing.assert_allclose(solver.solve(rhs), exact, atol=1e-14)


@pytest.fixture(params=[False, True], ids=["one-core", "two-cores"])
def cores(request, monkeypatch):
    """The multifrontal solver as small bodies have it, and as large ones."""
    limit = 0 if request.param else np.inf
    monkeypatch.setattr("fras_sim.fem.linear.multifrontal.WORTH_SPLITTING", limit)
    monkeypatch.setattr("fras_sim.fem.linear.multifrontal.WORTH_SHARING", limit)


@pytest.mark.usefixtures("cores")
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


@pytest.mark.usefixtures("cores")
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


@pytest.mark.usefixtures("cores")
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
from fras_sim.fem.pattern import sparsity_pattern
from fras_sim.fem import box_mesh
from fras_sim.fem.linear_solver import linear_solver

def digest(name, offset=0):
    kept = np.zeros(offset)  # moves what is allocated next
    mesh = box_mesh((0.1, 0.12, 0.005), (9, 11, 3))
    pattern = sparsity_pattern(mesh.elements, mesh.nodes_m, mesh.bottom_nodes[:30])
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


def plate(counts, fixed=(), renumber=False):
    mesh = box_mesh(node_counts=counts)
    elements, nodes_m = mesh.elements, mesh.nodes_m
    if renumber:
        number = np.random.default_rng(0).permutation(len(nodes_m))
        elements = number[elements].astype(np.int32)
        nodes_m = nodes_m[np.argsort(number)]
    return sparsity_pattern(elements, nodes_m, np.array(fixed, dtype=np.int32))


@pytest.mark.parametrize("counts", [(2, 2, 2), (9, 7, 2), (5, 25, 3), (6, 6, 6)])
@pytest.mark.parametrize("renumber", [False, True])
def test_each_front_reaches_what_its_nodes_touch(counts, renumber):
    fixed = np.arange(0, np.prod(counts), 5)
    pattern = plate(counts, fixed, renumber)
    fronts = dissection.dissect(pattern)
    order = np.concatenate([front.own for front in fronts])
    free = np.flatnonzero(pattern.row_of[:, 0] >= 0)
    np.testing.assert_array_equal(np.sort(order), free)
    place = {int(node): k for k, node in enumerate(order)}
    graph = dissection.Graph(pattern)
    for k, front in enumerate(fronts):
        assert all(child < k for child in front.children)
        last = place[int(front.own[-1])]
        touched = set(graph.edges(front.own)[1].tolist())
        for child in front.children:
            touched |= set(fronts[child].border.tolist())
        expected = sorted((node for node in touched if place[node] > last), key=place.__getitem__)
        assert front.border.tolist() == expected
    roots = set(range(len(fronts))) - {c for front in fronts for c in front.children}
    assert all(len(fronts[root].border) == 0 for root in roots)


def factor_entries(pattern):
    return sum(
        (3 * len(front.own)) * (3 * len(front.own) + 6 * len(front.border)) / 2
        for front in dissection.dissect(pattern)
    )


@pytest.mark.parametrize("renumber", [False, True])
def test_the_factor_of_a_plate_grows_like_n_log_n(renumber):
    """Four times the nodes: a band would take eight times the entries."""
    small, large = (factor_entries(plate((n, n, 2), (), renumber)) for n in (20, 40))
    assert 4.0 < large / small < 6.0


@pytest.mark.usefixtures("cores")
@pytest.mark.parametrize("name", DOUBLE)
def test_all_nodes_in_one_place_are_one_front(name):
    """Nothing says how to cut them; the matrix is as it is."""
    pattern = plate((5, 4, 3))
    pattern = dataclasses.replace(pattern, nodes_m=np.zeros_like(pattern.nodes_m))
    assert len(dissection.dissect(pattern)) == 1
    assert_solves(name, pattern, np.ones(pattern.n))


@pytest.mark.parametrize("name", ["scipy", "scipy-single"])
def test_nothing_free_is_nothing_to_solve(name):
    pattern = plate((2, 2, 2), range(8))
    solver = linear_solver(name, pattern)
    solver.factorize(np.zeros(0))
    assert solver.solve(np.zeros(0)).shape == (0,)


@pytest.mark.usefixtures("cores")
@pytest.mark.parametrize("name", DOUBLE)
def test_numbering_does_not_change_the_solution(name):
    pattern = plate((9, 4, 2), range(5), renumber=True)
    assert_solves(name, pattern, np.random.default_rng(1).standard_normal(pattern.n))


@pytest.mark.usefixtures("cores")
@pytest.mark.parametrize("name", DOUBLE)
def test_a_body_in_parts(name):
    """Fixed nodes may cut what is free into pieces, down to a single node."""
    mesh = box_mesh(node_counts=(2, 7, 2))
    fixed = np.flatnonzero(np.isin(mesh.nodes_m[:, 1], mesh.nodes_m[[8, 20], 1])).astype(np.int32)
    pattern = sparsity_pattern(mesh.elements, mesh.nodes_m, fixed)
    assert_solves(name, pattern, np.random.default_rng(1).standard_normal(pattern.n))


def test_auto_needs_no_mkl():
    assert linear_solver("auto", body_of((3, 3, 2)).pattern).name == "scipy-single"


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
