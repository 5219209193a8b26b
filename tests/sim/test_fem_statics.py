"""Equilibria, against felupe and against what must hold of any."""

from typing import Any, cast

import numpy as np
import pytest

from fras_sim.fem import (
    BadParameter,
    NotConverged,
    box_mesh,
    make_mesh,
    solve_static,
    split_into_tetrahedra,
    with_midside_nodes,
)
from fras_sim.fem.element import ElementKind
from fras_sim.fem.materials import MaterialName, lame_parameters

KINDS: list[ElementKind] = ["hex8", "tet4", "tet10"]
MATERIALS: list[MaterialName] = ["svk", "neo-hookean"]


def problem(kind, counts=(4, 5, 3)):
    """A distorted block, one side fixed, the other pulled, bent and twisted by half its length."""
    mesh = box_mesh((0.03, 0.04, 0.02), counts)
    if kind.startswith("tet"):
        mesh = split_into_tetrahedra(mesh)
    if kind == "tet10":
        mesh = with_midside_nodes(mesh)
    x, y, z = mesh.nodes_m.T
    inner = (y > 1e-9) & (y < 0.04 - 1e-9)
    shift = np.random.default_rng(7).uniform(-1, 1, mesh.nodes_m.shape)
    shift *= (4e-4 if kind == "tet10" else 1e-3) * inner[:, None]
    mesh = make_mesh(mesh.nodes_m + shift, mesh.elements, mesh.cell)
    fixed = np.flatnonzero(y < 1e-9)
    top = np.flatnonzero(y > 0.04 - 1e-9)
    turned = 0.4 * np.stack([-(z[top] - 0.01), 0 * x[top], x[top] - 0.015], axis=1)
    moved = turned + np.array([0.008, 0.018, 0.006])
    return mesh, fixed, {int(node): tuple(u) for node, u in zip(top, moved, strict=True)}


def felupe_solution(mesh, kind, material, fixed, prescribed):
    fe = pytest.importorskip("felupe")
    lam, mu = lame_parameters(3000.0, 0.45)
    one = np.eye(3)

    def svk_stress(x, **_):
        F = x[0]
        E = (np.einsum("kiqc,kjqc->ijqc", F, F) - one[..., None, None]) / 2
        S = 2 * mu * E + lam * np.einsum("kkqc->qc", E) * one[..., None, None]
        return [np.einsum("ikqc,kjqc->ijqc", F, S), x[-1]]

    def svk_tangent(x, **_):
        F = x[0]
        E = (np.einsum("kiqc,kjqc->ijqc", F, F) - one[..., None, None]) / 2
        S = 2 * mu * E + lam * np.einsum("kkqc->qc", E) * one[..., None, None]
        left = np.einsum("imqc,kmqc->ikqc", F, F)
        return [
            np.einsum("ik,jlqc->ijklqc", one, S)
            + mu * np.einsum("ikqc,jl->ijklqc", left, one)
            + mu * np.einsum("ilqc,kjqc->ijklqc", F, F)
            + lam * np.einsum("ijqc,klqc->ijklqc", F, F)
        ]

    cell_type, region = {
        "hex8": ("hexahedron", fe.RegionHexahedron),
        "tet4": ("tetra", fe.RegionTetra),
        "tet10": ("tetra10", fe.RegionQuadraticTetra),
    }[kind]
    field = fe.FieldContainer(
        [fe.Field(region(fe.Mesh(mesh.nodes_m, mesh.elements, cell_type)), dim=3)]
    )
    umat = (
        fe.Material(svk_stress, svk_tangent)
        if material == "svk"
        else fe.NeoHookeCompressible(mu=mu, lmbda=lam)
    )
    body = fe.SolidBody(umat, field)
    held = np.concatenate([fixed, np.array(list(prescribed))])
    held_at = np.concatenate([np.zeros((len(fixed), 3)), np.array(list(prescribed.values()))])
    dof0 = (3 * held[:, None] + np.arange(3)).ravel()
    dof1 = np.setdiff1d(np.arange(mesh.nodes_m.size), dof0)
    for load in np.linspace(0.1, 1.0, 10):
        order = np.argsort(dof0)
        ext0 = (load * held_at).ravel()[order]
        fe.newtonraphson(items=[body], dof0=dof0[order], dof1=dof1, ext0=ext0, tol=1e-13, verbose=0)
    return field[0].values, body.results.force.toarray().reshape(-1, 3)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("material", MATERIALS)
def test_displacement_and_reactions_are_felupe_s(kind, material):
    mesh, fixed, prescribed = problem(kind)
    expected_u, expected_force = felupe_solution(mesh, kind, material, fixed, prescribed)
    result = solve_static(
        mesh.nodes_m,
        mesh.elements,
        element=kind,
        fixed=fixed,
        prescribed=prescribed,
        material=material,
        tol=1e-12,
        young_modulus_pa=3000.0,
        poisson_ratio=0.45,
    )
    assert np.abs(expected_u).max() > 0.015
    scale = np.abs(expected_u).max()
    np.testing.assert_allclose(result.displacement_m, expected_u, rtol=0, atol=1e-8 * scale)
    held = np.concatenate([fixed, np.array(list(prescribed))])
    size = np.abs(expected_force).max()
    np.testing.assert_allclose(
        result.nodal_force_n[held], expected_force[held], rtol=0, atol=1e-8 * size
    )


@pytest.mark.parametrize("kind", ["hex8-sri", *KINDS])
@pytest.mark.parametrize("material", MATERIALS)
def test_an_affine_boundary_gives_the_affine_field(kind, material):
    mesh, _, _ = problem("hex8" if kind == "hex8-sri" else kind)
    if kind in ("hex8-sri", "tet10"):  # Reduced points pass the patch test on straight cells only.
        box = box_mesh((0.03, 0.04, 0.02), (4, 5, 3))
        mesh = with_midside_nodes(split_into_tetrahedra(box)) if kind == "tet10" else box
    F = np.array([[1.1, 0.2, 0.0], [-0.1, 0.95, 0.1], [0.0, 0.05, 1.05]])
    u = mesh.nodes_m @ (F - np.eye(3)).T
    outer = np.unique(mesh.surface)
    assert len(outer) < len(mesh.nodes_m)
    result = solve_static(
        mesh.nodes_m,
        mesh.elements,
        element=kind,
        fixed=[],
        prescribed={int(node): tuple(u[node]) for node in outer},
        material=material,
        young_modulus_pa=3000.0,
        poisson_ratio=0.45,
    )
    np.testing.assert_allclose(result.displacement_m, u, atol=1e-10)


@pytest.mark.parametrize("kind", ["hex8-sri", *KINDS])
def test_supports_balance_and_the_rest_is_free_of_force(kind):
    mesh, fixed, prescribed = problem("hex8" if kind == "hex8-sri" else kind)
    result = solve_static(
        mesh.nodes_m,
        mesh.elements,
        element=kind,
        fixed=fixed,
        prescribed=prescribed,
        young_modulus_pa=3000.0,
        poisson_ratio=0.45,
    )
    held = np.concatenate([fixed, np.array(list(prescribed))])
    free = np.setdiff1d(np.arange(len(mesh.nodes_m)), held)
    largest = np.abs(result.nodal_force_n).max()
    assert np.abs(result.nodal_force_n[free]).max() == pytest.approx(result.residual, rel=1e-6)
    assert result.residual <= 1e-10 * largest
    assert np.abs(result.nodal_force_n[held].sum(axis=0)).max() < 1e-8 * largest
    for node, u in prescribed.items():
        np.testing.assert_allclose(result.displacement_m[node], u, atol=1e-15)


def cube(kind, n):
    """Mesh of a cube with n cells along each edge, or what they are split into."""
    mesh = box_mesh((0.02, 0.02, 0.02), (n + 1, n + 1, n + 1))
    if kind.startswith("tet"):
        mesh = split_into_tetrahedra(mesh)
    if kind == "tet10":
        mesh = with_midside_nodes(mesh)
    return mesh


def boundary_work(kind, n):
    """Sum of f . u over the boundary of a cube whose whole boundary is bent smoothly."""
    mesh = cube(kind, n)
    x, y, z = mesh.nodes_m.T
    u = np.stack([8 * y * z, 3e-3 * np.sin(60 * x), 6 * x * y], axis=1)
    result = solve_static(
        mesh.nodes_m,
        mesh.elements,
        element=kind,
        fixed=[],
        prescribed={int(node): tuple(u[node]) for node in np.unique(mesh.surface)},
        young_modulus_pa=3000.0,
        poisson_ratio=0.3,
    )
    return np.sum(result.nodal_force_n * result.displacement_m)


@pytest.mark.parametrize(
    ("kind", "order", "sizes"),
    [
        ("hex8", 2.0, (2, 4, 8)),
        ("hex8-sri", 2.0, (2, 4, 8)),
        ("tet4", 2.0, (2, 4, 8)),
    ],
)
def test_solutions_converge_at_their_order(kind, order, sizes):
    """Work, like energy, converges twice as fast as the displacement's gradient."""
    coarse, middle, fine = (boundary_work(kind, n) for n in sizes)
    assert np.log2((coarse - middle) / (middle - fine)) == pytest.approx(order, rel=0.25)


def harmonic(x):
    """A gradient of a harmonic function, so small that strain is linear: no body force (Navier)."""
    a, b = np.array([48.0, 64.0, 0.0]), np.array([0.0, 0.0, 80.0])
    growing, along = np.exp(x @ a)[:, None], (x @ b)[:, None]
    return 1e-11 * growing * (np.cos(along) * a - np.sin(along) * b)


def distance_from_exact(kind, n):
    """Largest error of a node inside a cube whose surface is displaced as in `harmonic`."""
    mesh = cube(kind, n)
    exact = harmonic(mesh.nodes_m)
    outside = np.flatnonzero(np.abs(mesh.nodes_m - 0.01).max(axis=1) > 0.01 - 1e-9)
    result = solve_static(
        mesh.nodes_m,
        mesh.elements,
        element=kind,
        fixed=[],
        prescribed={int(node): tuple(exact[node]) for node in outside},
        young_modulus_pa=3000.0,
        poisson_ratio=0.3,
    )
    return np.abs(result.displacement_m - exact).max()


@pytest.mark.parametrize(
    ("kind", "least", "most"),
    [
        ("hex8", 1.9, 2.2),
        ("hex8-sri", 1.9, 2.2),
        ("tet4", 1.7, 2.2),
        # h³ is what theory promises, h⁴ what nodes of an even mesh can superconverge with.
        ("tet10", 2.9, 4.1),
    ],
)
def test_displacements_converge_to_an_exact_solution_at_their_order(kind, least, most):
    coarse, fine = (distance_from_exact(kind, n) for n in (4, 8))
    assert least <= np.log2(coarse / fine) <= most


def test_no_load_is_no_displacement():
    mesh, fixed, _ = problem("hex8")
    result = solve_static(
        mesh.nodes_m,
        mesh.elements,
        element="hex8-sri",
        fixed=fixed,
        prescribed={},
        young_modulus_pa=3000.0,
        poisson_ratio=0.45,
    )
    assert np.abs(result.displacement_m).max() < 1e-15


def test_neo_hookean_is_never_inverted_and_says_when_it_must_be():
    mesh, fixed, prescribed = problem("hex8")
    crushed = dict.fromkeys(prescribed, (0.0, -0.05, 0.0))
    with pytest.raises(NotConverged, match="%") as caught:
        solve_static(
            mesh.nodes_m,
            mesh.elements,
            element="hex8",
            fixed=fixed,
            prescribed=crushed,
            material="neo-hookean",
            young_modulus_pa=3000.0,
            poisson_ratio=0.45,
        )
    assert 0.0 < cast("float", caught.value.values["load"]) < 1.0


def test_what_cannot_be_solved_is_named():
    mesh, fixed, prescribed = problem("hex8")

    def solve(**changes: Any):
        arguments: dict[str, Any] = {"element": "hex8", "fixed": fixed, "prescribed": prescribed}
        arguments |= {"young_modulus_pa": 3000.0, "poisson_ratio": 0.45, **changes}
        return solve_static(mesh.nodes_m, mesh.elements, **arguments)

    for changes, message in [
        ({"element": cast("ElementKind", "hex20")}, "hex8-sri"),
        ({"tol": 0.0}, "between 0 and 1"),
        ({"fixed": [9999]}, "fixed"),
        ({"prescribed": {-1: (0.0, 0.0, 0.0)}}, "prescribed"),
        ({"prescribed": {50: (np.nan, 0.0, 0.0)}}, "finite"),
        ({"prescribed": {int(fixed[0]): (0.0, 0.0, 0.0)}}, "not fixed"),
        ({"fixed": fixed[:2], "prescribed": {}}, "one line"),
        ({"poisson_ratio": 0.5}, "poisson_ratio"),
    ]:
        with pytest.raises(BadParameter, match=message):
            solve(**changes)
