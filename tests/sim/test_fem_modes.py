"""Checkpoints, the quasi-static mode, forces by patch, other elements and materials in motion."""

import numpy as np
import pytest

from fras_sim.fem import (
    BadParameter,
    SolverOptions,
    TissueParameters,
    TissueSimulator,
    ToolInput,
    box_mesh,
    split_into_tetrahedra,
    with_midside_nodes,
)

TICK_M = 0.02 * 0.02
OPEN, CLOSED = 1.0, -0.3
DISCS = ((0.02, 0.02, 0.03), (0.085, 0.105, 0.025))
TIP_M = np.array([0.08, 0.04, 0.005])
UP = np.array([0.0, 0.0, 1.0])


def tissue_of(mesh=None, discs=DISCS, options=None, **parameters):
    mesh = box_mesh(node_counts=(11, 13, 2)) if mesh is None else mesh
    bottom = mesh.nodes_m[mesh.bottom_nodes]
    inside = [np.hypot(bottom[:, 0] - x, bottom[:, 1] - y) <= r for x, y, r in discs]
    fixed = mesh.bottom_nodes[np.any(inside, axis=0)]
    return TissueSimulator(mesh, TissueParameters(**parameters), fixed, options=options)


def path_of(height_m, hold=0, released=0):
    ticks = round(height_m / TICK_M)
    lifts = [0.0, *(TICK_M * np.arange(ticks + 1)), *[TICK_M * ticks] * (hold + released)]
    jaws = [OPEN, *[CLOSED] * (ticks + 1 + hold), *[OPEN] * released]
    return [{"psm1": ToolInput(TIP_M + z * UP, jaw)} for z, jaw in zip(lifts, jaws, strict=True)]


def bits(result):
    forces = [result.tool_force_n[arm] for arm in sorted(result.tool_force_n)]
    arrays = [result.nodes_m, result.nodal_force_n, result.patch_force_n, *forces]
    numbers = repr((result.solver, result.max_node_speed_m_s, result.balance_residual_n))
    return b"".join(np.ascontiguousarray(a).tobytes() for a in arrays) + numbers.encode()


@pytest.mark.parametrize("material", ["svk", "neo-hookean"])
def test_a_replay_from_a_checkpoint_gives_the_same_bits(material):
    """Through a grasp, a pull, a release and the way back to rest."""
    path = path_of(0.02, hold=3, released=12)
    original = tissue_of(material=material)
    checkpoints, results = {}, []
    for tools in path:
        results.append(bits(original.step(tools)))
        if original.checkpoint_due:
            checkpoint = original.checkpoint()
            checkpoints[checkpoint.tick] = checkpoint
    assert list(checkpoints) == list(range(10, len(path) + 1, 10))
    for tick, checkpoint in checkpoints.items():
        other = tissue_of(material=material)
        other.step({})
        other.restore(checkpoint)
        np.testing.assert_array_equal(other.checkpoint().nodes_m, checkpoint.nodes_m)
        assert [bits(other.step(tools)) for tools in path[tick:]] == results[tick:]


def test_a_checkpoint_is_a_copy_and_belongs_to_its_mesh():
    tissue = tissue_of()
    before = tissue.checkpoint()
    for tools in path_of(0.004):
        tissue.step(tools)
    np.testing.assert_array_equal(before.nodes_m, tissue.mesh.nodes_m)
    with pytest.raises(ValueError, match="read-only"):
        before.nodes_m[0] = 1.0
    with pytest.raises(BadParameter, match="checkpoint"):
        tissue_of(box_mesh(node_counts=(5, 5, 2))).restore(before)
    with pytest.raises(BadParameter, match="checkpoint_every"):
        SolverOptions(checkpoint_every=0)


@pytest.mark.parametrize("quasi_static", [False, True])
@pytest.mark.parametrize("gravity", [False, True])
def test_all_forces_balance_in_a_whole_trial(quasi_static, gravity):
    tissue = tissue_of(quasi_static=quasi_static, gravity=gravity)
    weight_n = 950.0 * 9.80665 * 0.1 * 0.12 * 0.005 * gravity
    for result in [tissue.step(tools) for tools in path_of(0.02, hold=2, released=20)]:
        assert result.solver.converged
        assert result.balance_residual_n < 1.001e-4
        np.testing.assert_allclose(
            result.patch_force_n.sum(axis=0), result.fixed_force_n, atol=1e-12
        )
    assert [len(patch) for patch in tissue.patches] == [
        len(tissue.fixed_nodes) - len(tissue.patches[1]),
        len(tissue.patches[1]),
    ]
    if gravity and quasi_static:
        result = tissue.measure({})
        bed_n = 3e5 * tissue.mesh.surface_area_m2 @ np.maximum(-result.nodes_m[:, 2], 0.0)
        assert bed_n + result.fixed_force_n[2] == pytest.approx(weight_n, rel=1e-2)


def test_a_tight_solver_balances_to_rounding():
    options = SolverOptions(
        step_tolerance_m=1e-11, residual_tolerance_n=1e-9, balance_tolerance_n=1e-8
    )
    tissue = tissue_of(options=options)
    for tools in path_of(0.004):
        result = tissue.step(tools)
        assert result.solver.converged
        assert result.balance_residual_n < 1.1e-8


def test_quasi_static_is_where_the_dynamics_come_to_rest():
    path = path_of(0.02)
    still, moving = tissue_of(quasi_static=True, bed=False), tissue_of(bed=False)
    at_once = [still.step(tools) for tools in path][-1]
    slowly = [moving.step(tools) for tools in [*path, *path[-1:] * 300]][-1]
    assert at_once.solver.converged
    np.testing.assert_allclose(at_once.nodes_m, slowly.nodes_m, atol=1e-4)
    assert at_once.max_force_n == pytest.approx(slowly.max_force_n, rel=1e-2)


def test_quasi_static_returns_to_rest_in_one_step():
    tissue = tissue_of(quasi_static=True)
    for tools in path_of(0.03):
        assert tissue.step(tools).solver.converged
    released = path_of(0.03, released=2)[-1:] * 2
    results = [tissue.step(tools) for tools in released]
    assert results[-1].solver.converged
    assert np.abs(results[-1].nodes_m - tissue.mesh.nodes_m).max() < 1e-4


def test_quasi_static_needs_a_body_that_cannot_turn():
    with pytest.raises(BadParameter, match="quasi_static"):
        tissue_of(discs=(), quasi_static=True)
    mesh = box_mesh(node_counts=(3, 3, 2))
    on_a_line = np.flatnonzero((mesh.nodes_m[:, 1] == 0) & (mesh.nodes_m[:, 2] == 0))
    with pytest.raises(BadParameter, match="one line"):
        TissueSimulator(mesh, TissueParameters(quasi_static=True), on_a_line)


@pytest.mark.parametrize("material", ["svk", "neo-hookean"])
@pytest.mark.parametrize("element", ["hex8-sri", "hex8", "tet4", "tet10"])
def test_every_element_and_material_is_pulled_and_comes_back(element, material):
    counts = (6, 7, 2) if element == "tet10" else (11, 13, 2)
    mesh = box_mesh(node_counts=counts)
    if element.startswith("tet"):
        mesh = split_into_tetrahedra(mesh)
    if element == "tet10":
        mesh = with_midside_nodes(mesh)
    tissue = tissue_of(mesh, element=element, material=material)
    results = [tissue.step(tools) for tools in path_of(0.03, released=120)]
    assert all(r.solver.converged for r in results)
    held = max(r.tool_force_n["psm1"][2] for r in results)
    assert 0.03 < held < 3.0
    assert np.abs(results[-1].nodes_m - mesh.nodes_m).max() < 1e-4


def test_an_element_that_does_not_fit_the_mesh_is_named():
    with pytest.raises(BadParameter, match="tet4"):
        tissue_of(split_into_tetrahedra(box_mesh(node_counts=(5, 5, 2))))
    with pytest.raises(BadParameter, match="material"):
        TissueParameters(material="jelly")  # pyright: ignore[reportArgumentType]
    with pytest.raises(BadParameter, match="element"):
        TissueParameters(element="hex20")  # pyright: ignore[reportArgumentType]
