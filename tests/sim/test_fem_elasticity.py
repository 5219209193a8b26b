from typing import cast

import numpy as np
import pytest

from fras_sim.fem import (
    BadMesh,
    BadParameter,
    Mesh,
    box_mesh,
    make_mesh,
    split_into_tetrahedra,
    with_midside_nodes,
)
from fras_sim.fem.assembly import ElasticBody
from fras_sim.fem.element import CELL_OF, ElementKind, quadrature
from fras_sim.fem.linear_solver import linear_solver
from fras_sim.fem.materials import MaterialName, lame_parameters
from fras_sim.fem.reference import REFERENCE

NONE = np.zeros(0, dtype=np.int32)
KINDS: list[ElementKind] = ["hex8-sri", "hex8", "tet4", "tet10"]
MATERIALS: list[MaterialName] = ["svk", "neo-hookean"]
AFFINE = np.array([[1.2, 0.3, 0.0], [-0.1, 0.9, 0.2], [0.0, 0.1, 1.1]])

every_kind = pytest.mark.parametrize("kind", KINDS)
every_material = pytest.mark.parametrize("material", MATERIALS)


def with_cells(box: Mesh, kind: str) -> Mesh:
    """The same box with the cells of an element kind."""
    if kind in ("hex8", "hex8-sri"):
        return box
    tets = split_into_tetrahedra(box)
    return tets if kind == "tet4" else with_midside_nodes(tets)


def distorted(kind="hex8-sri", counts=(4, 5, 3), seed=0):
    """A box whose inner and outer nodes are all shifted, and a smooth large deformation of it."""
    box = with_cells(box_mesh((0.03, 0.04, 0.02), counts), kind)
    size_m = 4e-4 if kind == "tet10" else 1.5e-3
    shift = size_m * np.random.default_rng(seed).uniform(-1, 1, box.nodes_m.shape)
    mesh = make_mesh(box.nodes_m + shift, box.elements, box.cell)
    x, y, z = mesh.nodes_m.T
    deformed = np.stack([x + 20 * y * z, 1.3 * y + 10 * x * x, z - 15 * x * y], axis=1)
    return mesh, deformed


def body_of(mesh, kind: ElementKind = "hex8-sri", fixed=NONE, material: MaterialName = "svk"):
    return ElasticBody(mesh, 3000.0, 0.45, kind, fixed, material)


def density(F, material):
    """W as in the textbook, from numpy alone."""
    lam, mu = lame_parameters(3000.0, 0.45)
    if material == "svk":
        E = (F.T @ F - np.eye(3)) / 2
        return mu * np.sum(E * E) + lam / 2 * np.trace(E) ** 2
    log_J = np.log(np.linalg.det(F))
    return mu / 2 * (np.sum(F * F) - 3) - mu * log_J + lam / 2 * log_J**2


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


@every_kind
@every_material
@pytest.mark.parametrize("ratio", [0.0, 0.7])
def test_force_is_the_gradient_of_the_energy(kind, material, ratio):
    mesh, x = distorted(kind)
    body = body_of(mesh, kind, material=material)
    viscosity = (ratio, body.strain(mesh.nodes_m + 0.3 * (x - mesh.nodes_m))[0])
    _, force = energy_and_force(body, x, *viscosity)
    rng = np.random.default_rng(1)
    for _ in range(5):
        way = rng.standard_normal(x.shape)
        step = 1e-7
        up, down = (energy_and_force(body, x + s * step * way, *viscosity)[0] for s in (1, -1))
        assert (up - down) / (2 * step) == pytest.approx(np.sum(force * way), rel=1e-6)


@every_kind
@every_material
def test_viscosity_is_that_of_a_kelvin_voigt_solid(kind, material):
    mesh, x = distorted(kind)
    body = body_of(mesh, kind, material=material)
    at_rest = body.strain(mesh.nodes_m)[0]
    elastic, force = energy_and_force(body, x)
    # From rest (E_n = 0) the viscous potential is c times that of St Venant-Kirchhoff.
    viscous = 0.5 * energy_and_force(body_of(mesh, kind), x)[0]
    with_viscosity, _ = energy_and_force(body, x, 0.5, at_rest)
    assert with_viscosity == pytest.approx(elastic + viscous, rel=1e-12)
    _, still = energy_and_force(body, x, 0.5, body.strain(x)[0])
    np.testing.assert_allclose(still, force, atol=1e-12)


@every_kind
@every_material
@pytest.mark.parametrize("ratio", [0.0, 0.7])
def test_hessian_is_the_derivative_of_the_force(kind, material, ratio):
    mesh, x = distorted(kind, (3, 3, 2))
    body = body_of(mesh, kind, material=material)
    viscosity = (ratio, body.strain(mesh.nodes_m + 0.3 * (x - mesh.nodes_m))[0])
    matrix = dense(body, body.hessian(x, *viscosity, project=False))
    np.testing.assert_array_equal(matrix, matrix.T)
    step = 1e-7
    numeric = np.empty_like(matrix)
    for column in range(x.size):
        way = np.zeros(x.size)
        way[column] = step
        up, down = (
            energy_and_force(body, x + s * way.reshape(x.shape), *viscosity)[1] for s in (1, -1)
        )
        numeric[:, column] = (up - down).ravel() / (2 * step)
    assert np.abs(matrix - numeric).max() < 1e-6 * np.abs(numeric).max()


@every_kind
@every_material
def test_projected_hessian_is_semidefinite_and_an_upper_bound(kind, material):
    mesh, x = distorted(kind, (3, 3, 2))
    body = body_of(mesh, kind, material=material)
    squeezed = mesh.nodes_m * [0.7, 0.6, 0.8]
    for shape in (x, squeezed):
        exact, projected = (dense(body, body.hessian(shape, project=p)) for p in (False, True))
        largest = np.abs(np.linalg.eigvalsh(projected)).max()
        assert np.linalg.eigvalsh(projected).min() > -1e-10 * largest
        assert np.linalg.eigvalsh(projected - exact).min() > -1e-10 * largest
    assert np.linalg.eigvalsh(dense(body, body.hessian(squeezed, project=False))).min() < -1e-3


# Not neo-Hookean with reduced integration: a point with lambda alone is indefinite once J > 1.
@pytest.mark.parametrize(
    ("kind", "material"),
    [*((kind, "svk") for kind in KINDS), *((kind, "neo-hookean") for kind in KINDS[1:])],
)
def test_projection_changes_nothing_in_uniform_tension(kind, material):
    mesh, _ = distorted(kind, (3, 3, 2))
    body = body_of(mesh, kind, material=material)
    blown_up = (1.2 if material == "svk" else 1.001) * mesh.nodes_m
    exact, projected = (body.hessian(blown_up, project=p) for p in (False, True))
    np.testing.assert_allclose(projected, exact, rtol=1e-9, atol=1e-9)


def test_fixed_nodes_are_eliminated():
    mesh, x = distorted()
    free_matrix = dense(body_of(mesh), body_of(mesh).hessian(x))
    fixed = np.array([0, 7, 11], dtype=np.int32)
    body = body_of(mesh, fixed=fixed)
    rest = np.setdiff1d(np.arange(x.size), (3 * fixed[:, None] + np.arange(3)).ravel())
    np.testing.assert_allclose(
        dense(body, body.hessian(x)), free_matrix[np.ix_(rest, rest)], rtol=1e-12, atol=1e-12
    )


@every_kind
@every_material
def test_rigid_motion_gives_no_force(kind, material):
    mesh, _ = distorted(kind)
    body = body_of(mesh, kind, material=material)
    x = mesh.nodes_m @ rotation([1, -2, 0.5], 2.0).T + [0.3, -0.1, 0.2]
    energy, force = energy_and_force(body, x)
    assert abs(energy) < (1e-18 if material == "svk" else 1e-16)
    assert np.abs(force).max() < 1e-11


@every_kind
@every_material
def test_energy_is_blind_to_rotation(kind, material):
    mesh, x = distorted(kind)
    body = body_of(mesh, kind, material=material)
    turn = rotation([0.2, 1, 1], 1.1)
    energy, force = energy_and_force(body, x)
    turned_energy, turned_force = energy_and_force(body, x @ turn.T)
    assert turned_energy == pytest.approx(energy, rel=1e-12)
    np.testing.assert_allclose(turned_force, force @ turn.T, atol=1e-12)


@every_kind
@every_material
def test_internal_forces_balance(kind, material):
    mesh, x = distorted(kind)
    _, force = energy_and_force(body_of(mesh, kind, material=material), x)
    assert np.abs(force).max() > 1e-3
    assert np.abs(force.sum(axis=0)).max() < 1e-12
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-13


@every_kind
@every_material
def test_patch_affine_field_is_in_equilibrium_inside(kind, material):
    """The patch test: on a parallelepiped mesh of unequal cells an affine field is a solution."""
    box = with_cells(box_mesh((0.03, 0.04, 0.02), (4, 5, 4)), kind)
    skew = np.array([[1.0, 0.2, 0.1], [0.0, 1.1, 0.3], [0.1, 0.0, 0.9]])
    mesh = make_mesh(box.nodes_m @ skew.T, box.elements, box.cell)
    energy, force = energy_and_force(body_of(mesh, kind, NONE, material), mesh.nodes_m @ AFFINE.T)
    inner = np.setdiff1d(np.arange(len(mesh.nodes_m)), mesh.surface)
    assert len(inner) == (5 * 7 * 5 if kind == "tet10" else 2 * 3 * 2)
    assert np.abs(force[inner]).max() < 1e-14 < 1e-3 < np.abs(force).max()
    volume_m3 = 0.03 * 0.04 * 0.02 * np.linalg.det(skew)
    assert energy == pytest.approx(density(AFFINE, material) * volume_m3, rel=1e-12)


@every_material
@pytest.mark.parametrize("kind", ["hex8", "tet4"])
def test_patch_distorted(kind, material):
    """With full integration the patch test holds on distorted elements too."""
    mesh, _ = distorted(kind, (4, 5, 4))
    _, force = energy_and_force(body_of(mesh, kind, NONE, material), mesh.nodes_m @ AFFINE.T)
    inner = np.setdiff1d(np.arange(len(mesh.nodes_m)), mesh.surface)
    assert np.abs(force[inner]).max() < 1e-12 < np.abs(force).max()


@every_material
@pytest.mark.parametrize(
    ("kind", "order"), [("hex8-sri", 2.0), ("hex8", 2.0), ("tet4", 2.0), ("tet10", 4.0)]
)
def test_energy_converges_at_its_order(kind, order, material):
    """The energy of the interpolated field: h² for linear elements, h⁴ for quadratic ones."""

    def energy(n):
        mesh = with_cells(box_mesh((0.03, 0.04, 0.02), (3 * n + 1, 4 * n + 1, 2 * n + 1)), kind)
        x, y, z = mesh.nodes_m.T
        bent = np.stack([x + 8 * y * z + 90 * y**3, y + 6 * x * x, z + 3e-3 * np.sin(60 * y)], 1)
        return energy_and_force(body_of(mesh, kind, material=material), bent)[0]

    sizes = (1, 2, 4) if kind == "tet10" else (2, 4, 8)
    coarse, fine = np.diff([energy(n) for n in sizes])
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.1 if order < 3 else 0.4)


@every_material
@pytest.mark.parametrize("aspect", [2.0, 4.0, 10.0])
def test_a_long_element_bends_as_a_plate_does(aspect, material):
    """Energy of one element under a bending strain E_xx = k z, against plate theory."""
    thick_m, k = 0.002, 1e-3
    mesh = box_mesh((aspect * thick_m, aspect * thick_m, thick_m), (2, 2, 2))
    centred = mesh.nodes_m - 0.5 * np.ptp(mesh.nodes_m, axis=0)
    x = mesh.nodes_m.copy()
    x[:, 0] += k * centred[:, 0] * centred[:, 2]
    plate_pa = 3000.0 / (1.0 - 0.45**2)
    exact_j = 0.5 * plate_pa * k**2 * thick_m**2 / 12.0 * (aspect * thick_m) ** 2 * thick_m
    energy = {
        kind: energy_and_force(body_of(mesh, kind, NONE, material), x)[0] for kind in KINDS[:2]
    }
    assert energy["hex8-sri"] == pytest.approx(exact_j, rel=1e-3)
    assert energy["hex8"] > 1.8 * exact_j


def test_a_cube_counts_its_points_in_full():
    points = quadrature(box_mesh((0.01, 0.01, 0.01), (3, 3, 3)), "hex8-sri", 0.45)
    np.testing.assert_allclose(points.shear_weights[:, :8].sum(axis=1), 0.005**3, rtol=1e-12)
    np.testing.assert_allclose(points.shear_weights[:, 8], 0.0, atol=1e-20)


def test_reduced_integration_is_softer_where_full_integration_locks():
    """A thin clamped strip, nearly incompressible, loaded at its end: one linear solve each."""
    mesh = box_mesh((0.02, 0.06, 0.005), (5, 13, 2))
    fixed = np.flatnonzero(mesh.nodes_m[:, 1] == 0.0).astype(np.int32)
    end = mesh.nodes_m[:, 1] > 0.06 - 1e-9
    load = np.zeros_like(mesh.nodes_m)
    load[end, 2] = -1e-6 / end.sum()
    drop_m = {}
    for kind in KINDS[:2]:
        body = body_of(mesh, kind, fixed)
        solver = linear_solver("scipy", body.pattern)
        solver.factorize(body.hessian(mesh.nodes_m))
        u = np.zeros(load.size)
        u[body.pattern.free] = solver.solve(load.ravel()[body.pattern.free])
        drop_m[kind] = -u.reshape(load.shape)[end, 2].mean()
    beam_m = 1e-6 * 0.06**3 / (3 * 3000.0 * 0.02 * 0.005**3 / 12)
    assert drop_m["hex8"] < 0.8 * drop_m["hex8-sri"]
    assert drop_m["hex8-sri"] < beam_m


@pytest.mark.parametrize("cell", ["hex8", "tet4", "tet10"])
def test_shape_functions_are_a_partition_of_unity(cell):
    element = REFERENCE[cell]
    points = np.random.default_rng(0).uniform(0.0, 0.5, (5, 3))
    np.testing.assert_allclose(element.shape(points).sum(axis=1), 1.0)
    np.testing.assert_allclose(element.derivatives(points).sum(axis=1), 0.0, atol=1e-15)
    step = 1e-6 * np.eye(3)
    for j in range(3):
        numeric = (element.shape(points + step[j]) - element.shape(points - step[j])) / 2e-6
        np.testing.assert_allclose(element.derivatives(points)[:, :, j], numeric, atol=1e-8)


@every_kind
def test_quadrature_weights_fill_the_volume(kind):
    mesh = with_cells(box_mesh(), kind)
    points = quadrature(mesh, kind)
    for weights in (points.shear_weights, points.bulk_weights, points.nodal_volumes):
        assert weights.sum() == pytest.approx(0.1 * 0.12 * 0.005, rel=1e-12)
    assert points.nodal_volumes.min() > 0.0


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
    assert energy_and_force(body_of(mesh, material="neo-hookean"), x)[0] == np.inf


def test_material_and_element_are_checked():
    assert lame_parameters(3000.0, 0.25) == pytest.approx((1200.0, 1200.0))
    for young, poisson in ((3000.0, 0.5), (3000.0, -1.0), (0.0, 0.3), (np.nan, 0.3), (3e3, np.nan)):
        with pytest.raises(BadParameter):
            lame_parameters(young, poisson)
    mesh = box_mesh((1.0, 1.0, 1.0), (2, 2, 2))
    with pytest.raises(BadParameter, match="svk, neo-hookean"):
        body_of(mesh, material=cast("MaterialName", "jelly"))
    turned = Mesh(mesh.nodes_m, mesh.elements[:, [4, 5, 6, 7, 0, 1, 2, 3]], mesh.surface)
    with pytest.raises(BadMesh, match="inverted"):
        quadrature(turned)
    for kind, cell in CELL_OF.items():
        fitting = with_cells(mesh, kind)
        assert fitting.cell == cell
        with pytest.raises(BadParameter, match=f"mesh of {cell}"):
            quadrature(fitting, cast("ElementKind", "hex9"))
    with pytest.raises(BadParameter, match="'tet4' for a mesh of tet4"):
        quadrature(with_cells(mesh, "tet4"), "hex8")
