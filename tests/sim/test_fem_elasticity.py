from typing import cast

import numpy as np
import pytest

from fras_sim.fem import BadMesh, BadParameter, Mesh, box_mesh
from fras_sim.fem.assembly import ElasticBody
from fras_sim.fem.element import (
    CORNERS,
    GAUSS_POINTS,
    ElementKind,
    quadrature,
    shape_derivatives,
    shape_functions,
)
from fras_sim.fem.kernels import positive_part
from fras_sim.fem.linear_solver import linear_solver
from fras_sim.fem.material import lame_parameters

NONE = np.zeros(0, dtype=np.int32)
KINDS: list[ElementKind] = ["hex8-sri", "hex8"]


def distorted(counts=(4, 5, 3), seed=0):
    """A box whose inner and outer nodes are all shifted, and a smooth large deformation of it."""
    box = box_mesh((0.03, 0.04, 0.02), counts)
    shift = 1.5e-3 * np.random.default_rng(seed).uniform(-1, 1, box.nodes_m.shape)
    mesh = Mesh(box.nodes_m + shift, box.elements, box.surface)
    x, y, z = mesh.nodes_m.T
    deformed = np.stack([x + 20 * y * z, 1.3 * y + 10 * x * x, z - 15 * x * y], axis=1)
    return mesh, deformed


def body_of(mesh, kind: ElementKind = "hex8-sri", fixed=NONE):
    return ElasticBody(mesh, 3000.0, 0.45, kind, fixed)


def energy_and_force(body, x, *viscosity):
    force = np.zeros_like(x)
    return body.energy_gradient(x, force, *viscosity), force


def dense(body, values):
    pattern = body.pattern
    matrix = np.zeros((pattern.n, pattern.n))
    matrix[pattern.rows, pattern.indices] = values
    return matrix + np.triu(matrix, 1).T


def rotation(axis, angle_rad):
    axis = np.asarray(axis) / np.linalg.norm(axis)
    k = np.cross(np.eye(3), axis)
    return np.eye(3) + np.sin(angle_rad) * k + (1 - np.cos(angle_rad)) * k @ k


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ratio", [0.0, 0.7])
def test_force_is_the_gradient_of_the_energy(kind, ratio):
    mesh, x = distorted()
    body = body_of(mesh, kind)
    viscosity = (ratio, body.strain(mesh.nodes_m + 0.3 * (x - mesh.nodes_m))[0])
    _, force = energy_and_force(body, x, *viscosity)
    rng = np.random.default_rng(1)
    for _ in range(5):
        way = rng.standard_normal(x.shape)
        step = 1e-7
        up, down = (energy_and_force(body, x + s * step * way, *viscosity)[0] for s in (1, -1))
        assert (up - down) / (2 * step) == pytest.approx(np.sum(force * way), rel=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_viscous_potential_is_kelvin_voigt_s(kind):
    mesh, x = distorted()
    body = body_of(mesh, kind)
    before = body.strain(mesh.nodes_m)[0]
    elastic, _ = energy_and_force(body, x)
    with_viscosity, _ = energy_and_force(body, x, 0.5, before)
    # From rest (E_n = 0) the incremental potential is W + c W.
    assert with_viscosity == pytest.approx(1.5 * elastic, rel=1e-12)
    at_x = body.strain(x)[0]
    _, still = energy_and_force(body, x, 0.5, at_x)
    np.testing.assert_allclose(still, energy_and_force(body, x)[1], atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_hessian_is_the_derivative_of_the_force(kind):
    mesh, x = distorted((3, 3, 3))
    body = body_of(mesh, kind)
    matrix = dense(body, body.hessian(x, project=False))
    step = 1e-7
    numeric = np.empty_like(matrix)
    for column in range(x.size):
        way = np.zeros(x.size)
        way[column] = step
        up, down = (energy_and_force(body, x + s * way.reshape(x.shape))[1] for s in (1, -1))
        numeric[:, column] = (up - down).ravel() / (2 * step)
    assert np.abs(matrix - numeric).max() < 1e-6 * np.abs(numeric).max()


@pytest.mark.parametrize("kind", KINDS)
def test_projected_hessian_is_semidefinite_and_exact_where_stress_is(kind):
    mesh, x = distorted((3, 3, 3))
    body = body_of(mesh, kind)
    squeezed = mesh.nodes_m * [0.7, 0.6, 0.8]
    for shape in (x, squeezed):
        values = np.linalg.eigvalsh(dense(body, body.hessian(shape)))
        assert values.min() > -1e-10 * values.max()
    assert np.linalg.eigvalsh(dense(body, body.hessian(squeezed, project=False))).min() < -1e-3
    blown_up = 1.2 * mesh.nodes_m
    np.testing.assert_allclose(
        body.hessian(blown_up), body.hessian(blown_up, project=False), rtol=1e-9, atol=1e-9
    )


def test_fixed_nodes_are_eliminated():
    mesh, x = distorted()
    free_matrix = dense(body_of(mesh), body_of(mesh).hessian(x))
    fixed = np.array([0, 7, 11], dtype=np.int32)
    body = body_of(mesh, fixed=fixed)
    rest = np.setdiff1d(np.arange(x.size), (3 * fixed[:, None] + np.arange(3)).ravel())
    np.testing.assert_allclose(
        dense(body, body.hessian(x)), free_matrix[np.ix_(rest, rest)], rtol=1e-12, atol=1e-12
    )


@pytest.mark.parametrize("kind", KINDS)
def test_rigid_motion_gives_no_force(kind):
    mesh, _ = distorted()
    body = body_of(mesh, kind)
    x = mesh.nodes_m @ rotation([1, -2, 0.5], 2.0).T + [0.3, -0.1, 0.2]
    energy, force = energy_and_force(body, x)
    assert energy < 1e-18
    assert np.abs(force).max() < 1e-11


def test_energy_is_blind_to_rotation():
    mesh, x = distorted()
    body = body_of(mesh)
    turn = rotation([0.2, 1, 1], 1.1)
    energy, force = energy_and_force(body, x)
    turned_energy, turned_force = energy_and_force(body, x @ turn.T)
    assert turned_energy == pytest.approx(energy, rel=1e-12)
    np.testing.assert_allclose(turned_force, force @ turn.T, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_internal_forces_balance(kind):
    mesh, x = distorted()
    _, force = energy_and_force(body_of(mesh, kind), x)
    assert np.abs(force).max() > 1e-3
    assert np.abs(force.sum(axis=0)).max() < 1e-12
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-13


@pytest.mark.parametrize("kind", KINDS)
def test_patch_affine_field_is_in_equilibrium_inside(kind):
    """The patch test: on a parallelepiped mesh of unequal cells an affine field is a solution."""
    box = box_mesh((0.03, 0.04, 0.02), (4, 5, 4))
    skew = np.array([[1.0, 0.2, 0.1], [0.0, 1.1, 0.3], [0.1, 0.0, 0.9]])
    mesh = Mesh(box.nodes_m @ skew.T, box.elements, box.surface)
    F = np.array([[1.2, 0.3, 0.0], [-0.1, 0.9, 0.2], [0.0, 0.1, 1.1]])
    energy, force = energy_and_force(body_of(mesh, kind), mesh.nodes_m @ F.T)
    inner = np.setdiff1d(np.arange(len(mesh.nodes_m)), mesh.surface)
    assert len(inner) == 2 * 3 * 2
    assert np.abs(force[inner]).max() < 1e-14
    lam, mu = lame_parameters(3000.0, 0.45)
    E = (F.T @ F - np.eye(3)) / 2
    density = mu * np.sum(E * E) + lam / 2 * np.trace(E) ** 2
    assert energy == pytest.approx(density * 0.03 * 0.04 * 0.02 * np.linalg.det(skew), rel=1e-12)


def test_patch_distorted_full_integration():
    """With full integration the patch test holds on distorted elements too."""
    mesh, _ = distorted((4, 5, 4))
    F = np.array([[1.2, 0.3, 0.0], [-0.1, 0.9, 0.2], [0.0, 0.1, 1.1]])
    _, force = energy_and_force(body_of(mesh, "hex8"), mesh.nodes_m @ F.T)
    inner = np.setdiff1d(np.arange(len(mesh.nodes_m)), mesh.surface)
    assert np.abs(force[inner]).max() < 1e-12 < np.abs(force).max()


@pytest.mark.parametrize("kind", KINDS)
def test_energy_converges_at_second_order(kind):
    def energy(n):
        mesh = box_mesh((0.03, 0.04, 0.02), (3 * n + 1, 4 * n + 1, 2 * n + 1))
        x, y, z = mesh.nodes_m.T
        bent = np.stack([x + 8 * y * z + 90 * y**3, y + 6 * x * x, z + 3e-3 * np.sin(60 * y)], 1)
        return energy_and_force(body_of(mesh, kind), bent)[0]

    coarse, fine = np.diff([energy(n) for n in (2, 4, 8)])
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


def test_reduced_integration_is_softer_where_full_integration_locks():
    """A thin clamped strip, nearly incompressible, loaded at its end: one linear solve each."""
    mesh = box_mesh((0.02, 0.06, 0.005), (5, 13, 2))
    fixed = np.flatnonzero(mesh.nodes_m[:, 1] == 0.0).astype(np.int32)
    end = mesh.nodes_m[:, 1] > 0.06 - 1e-9
    load = np.zeros_like(mesh.nodes_m)
    load[end, 2] = -1e-6 / end.sum()
    drop_m = {}
    for kind in KINDS:
        body = body_of(mesh, kind, fixed)
        solver = linear_solver("scipy", body.pattern)
        solver.factorize(body.hessian(mesh.nodes_m))
        u = np.zeros(load.size)
        u[body.pattern.free] = solver.solve(load.ravel()[body.pattern.free])
        drop_m[kind] = -u.reshape(load.shape)[end, 2].mean()
    beam_m = 1e-6 * 0.06**3 / (3 * 3000.0 * 0.02 * 0.005**3 / 12)
    assert drop_m["hex8"] < 0.8 * drop_m["hex8-sri"]
    assert drop_m["hex8-sri"] < beam_m


def test_shape_functions_are_a_partition_of_unity():
    points = np.random.default_rng(0).uniform(-1, 1, (5, 3))
    np.testing.assert_allclose(shape_functions(points).sum(axis=1), 1.0)
    np.testing.assert_allclose(shape_derivatives(points).sum(axis=1), 0.0, atol=1e-15)
    np.testing.assert_allclose(shape_functions(CORNERS), np.eye(8), atol=1e-15)
    np.testing.assert_allclose(shape_functions(GAUSS_POINTS) @ CORNERS, GAUSS_POINTS)


@pytest.mark.parametrize("kind", KINDS)
def test_quadrature_weights_fill_the_volume(kind):
    mesh = box_mesh()
    points = quadrature(mesh, kind)
    for weights in (points.shear_weights, points.bulk_weights, points.nodal_volumes):
        assert weights.sum() == pytest.approx(0.1 * 0.12 * 0.005, rel=1e-12)


def test_positive_part_agrees_with_eigh():
    rng = np.random.default_rng(3)
    for _ in range(50):
        matrix = rng.standard_normal((3, 3))
        matrix = matrix + matrix.T
        values, vectors = np.linalg.eigh(matrix)
        expected = vectors @ np.diag(np.maximum(values, 0)) @ vectors.T
        positive_part(matrix, np.empty((3, 3)))
        np.testing.assert_allclose(matrix, expected, atol=1e-12)


def test_strain_energy_of_inverted_elements_is_finite_and_they_are_named():
    mesh = box_mesh((0.03, 0.04, 0.02), (4, 5, 3))
    body = body_of(mesh)
    x = mesh.nodes_m.copy()
    x[mesh.elements[5]] = x[mesh.elements[5]][:, :] * [1, 1, -1]
    _, inverted = body.strain(x)
    assert 5 in inverted
    energy, force = energy_and_force(body, x)
    assert np.isfinite(energy)
    assert np.isfinite(force).all()


def test_material_and_element_are_checked():
    assert lame_parameters(3000.0, 0.25) == pytest.approx((1200.0, 1200.0))
    for young, poisson in ((3000.0, 0.5), (3000.0, -1.0), (0.0, 0.3), (np.nan, 0.3), (3e3, np.nan)):
        with pytest.raises(BadParameter):
            lame_parameters(young, poisson)
    mesh = box_mesh((1.0, 1.0, 1.0), (2, 2, 2))
    with pytest.raises(BadParameter, match="hex8-sri"):
        quadrature(mesh, cast("ElementKind", "hex9"))
    turned = Mesh(mesh.nodes_m, mesh.elements[:, [4, 5, 6, 7, 0, 1, 2, 3]], mesh.surface)
    with pytest.raises(BadMesh, match="inverted"):
        quadrature(turned)
