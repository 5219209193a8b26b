import numpy as np
import pytest

from fras_sim.fem import (
    BadParameter,
    BadToolInput,
    SolverOptions,
    TissueParameters,
    TissueSimulator,
    ToolInput,
    box_mesh,
)

COUNTS = (11, 13, 2)
TICK_M = 0.02 * 0.02
OPEN, CLOSED = 1.0, -0.3
# Two discs of 30 and 25 mm: a third of the bottom.
DISCS = ((0.02, 0.02, 0.03), (0.085, 0.105, 0.025))
TIP_M = np.array([0.08, 0.04, 0.005])
UP = np.array([0.0, 0.0, 1.0])


def tissue_of(counts=COUNTS, discs=DISCS, options=None, **parameters):
    mesh = box_mesh(node_counts=counts)
    bottom = mesh.nodes_m[mesh.bottom_nodes]
    inside = [np.hypot(bottom[:, 0] - x, bottom[:, 1] - y) <= r for x, y, r in discs]
    fixed = mesh.bottom_nodes[np.any(inside, axis=0)]
    return TissueSimulator(mesh, TissueParameters(**parameters), fixed, options=options)


def play(tissue, path):
    """Feed (tip, jaw) pairs to psm1; yields each result."""
    for tip_m, jaw in path:
        yield tissue.step({"psm1": ToolInput(np.asarray(tip_m), jaw)})


def pull(height_m=0.05, tip_m=TIP_M):
    yield tip_m, OPEN
    yield tip_m, CLOSED
    for tick in range(1, round(height_m / TICK_M) + 1):
        yield tip_m + tick * TICK_M * UP, CLOSED


def wait(tissue, ticks):
    """Let the tissue move on without a tool; the last result."""
    return [tissue.step({}) for _ in range(ticks)][-1]


def displacement_m(tissue, result):
    return float(np.linalg.norm(result.nodes_m - tissue.mesh.nodes_m, axis=1).max())


def test_measure_is_the_rest_and_changes_nothing():
    tissue = tissue_of()
    tool = {"psm1": ToolInput(TIP_M, OPEN)}
    first, second = tissue.measure(tool), tissue.measure(tool)
    np.testing.assert_array_equal(first.nodes_m, tissue.mesh.nodes_m)
    np.testing.assert_array_equal(second.nodes_m, tissue.mesh.nodes_m)
    assert first.max_force_n < 1e-12
    assert first.solver.converged
    assert list(first.grasped) == ["psm1"]
    assert len(first.grasped["psm1"]) == 0
    with pytest.raises(ValueError, match="read-only"):
        first.nodes_m[0, 0] = 1.0


def test_rest_stays_at_rest():
    tissue = tissue_of()
    result = wait(tissue, 5)
    assert result.solver.converged
    assert displacement_m(tissue, result) < 1e-15


def test_a_pull_of_50_mm_stays_finite_and_converges():
    tissue = tissue_of()
    results = list(play(tissue, pull()))
    assert all(r.solver.converged for r in results)
    assert all(np.isfinite(r.nodes_m).all() for r in results)
    last = results[-1]
    held = last.grasped["psm1"]
    np.testing.assert_allclose(
        last.nodes_m[held], tissue.mesh.nodes_m[held] + [0.0, 0.0, 0.05], atol=1e-12
    )
    np.testing.assert_array_equal(
        last.nodes_m[tissue.fixed_nodes], tissue.mesh.nodes_m[tissue.fixed_nodes]
    )
    assert 0.05 < last.max_force_n < 2.0
    norms = np.linalg.norm(last.nodal_force_n, axis=1)
    assert last.max_force_n == norms.max()
    # Slow enough that inertia adds no more than a little to the elastic force.
    np.testing.assert_allclose(
        last.tool_force_n["psm1"], last.nodal_force_n[held].sum(axis=0), atol=0.02
    )
    assert last.tool_force_n["psm1"][2] > 0.05
    assert np.mean([r.solver.iterations for r in results]) < 6


def test_forces_balance_at_the_end_of_a_pull():
    """At rest the tool, the fixed nodes and the bed hold each other."""
    tissue = tissue_of(bed=False)
    path = list(pull(0.02))
    path += [path[-1]] * 300
    last = list(play(tissue, path))[-1]
    assert last.max_node_speed_m_s < 1e-4
    held, fixed = last.grasped["psm1"], tissue.fixed_nodes
    assert np.abs(last.nodal_force_n.sum(axis=0)).max() < 1e-12
    reaction = last.nodal_force_n[fixed].sum(axis=0)
    np.testing.assert_allclose(reaction + last.tool_force_n["psm1"], 0.0, atol=1e-3)
    others = np.setdiff1d(np.arange(len(last.nodes_m)), np.concatenate([held, fixed]))
    assert np.abs(last.nodal_force_n[others]).max() < 1e-4


@pytest.mark.parametrize("discs", [DISCS, ((0.05, 0.06, 0.025),)])
def test_release_returns_to_rest(discs):
    tissue = tissue_of(discs=discs)
    path = list(pull(0.05))
    top_m = path[-1][0]
    results = list(play(tissue, [*path, *[(top_m, OPEN)] * 200]))
    assert all(r.solver.converged for r in results)
    released = results[len(path) :]
    assert len(released[0].grasped["psm1"]) == 0
    np.testing.assert_array_equal(released[0].tool_force_n["psm1"], 0.0)
    assert min(r.max_node_speed_m_s for r in released[:100]) < 1e-3
    assert displacement_m(tissue, released[-1]) < 1e-4
    assert released[-1].solver.inverted_elements == 0


def test_energy_decays_after_a_release():
    tissue = tissue_of(bed=False)
    path = list(pull(0.03))
    for _ in play(tissue, [*path, (path[-1][0], OPEN)]):
        pass
    energies = [tissue.mechanical_energy_j()]
    for _ in range(100):
        tissue.step({})
        energies.append(tissue.mechanical_energy_j())
    drops = np.diff(energies)
    assert drops.max() <= 1e-9 * energies[0]
    assert energies[-1] < 1e-3 * energies[0]


def test_damping_damps():
    def remaining(**damping):
        tissue = tissue_of(bed=False, **damping)
        path = list(pull(0.01))
        list(play(tissue, [*path, *[(path[-1][0], OPEN)] * 10]))
        return tissue.mechanical_energy_j()

    free = remaining(mass_damping_per_s=0.0, stiffness_damping_s=0.0)
    assert remaining(mass_damping_per_s=10.0, stiffness_damping_s=0.0) < 0.9 * free
    assert remaining(mass_damping_per_s=0.0, stiffness_damping_s=0.1) < 0.9 * free


def test_bed_carries_the_weight():
    tissue = tissue_of(discs=(), gravity=True)
    result = wait(tissue, 100)
    depth_m = -result.nodes_m[:, 2].min()
    pressure_pa = 950.0 * 9.80665 * 0.005
    # Bottom nodes sink evenly; the rim also carries its share of the side faces.
    assert depth_m == pytest.approx(pressure_pa / 3e5, rel=0.15)
    assert result.max_node_speed_m_s < 1e-4


def test_bed_stops_what_would_fall_through():
    # Beside a node column, so that only the node on top is led.
    tip_m = TIP_M + np.array([0.002, 0.002, 0.0])
    deepest_m = {}
    for bed in (True, False):
        tissue = tissue_of(bed=bed)
        path = [(tip_m, OPEN), (tip_m, CLOSED)]
        path += [(tip_m - tick * TICK_M * UP, CLOSED) for tick in range(1, 11)]
        last = list(play(tissue, path))[-1]
        assert len(last.grasped["psm1"]) == 1
        deepest_m[bed] = last.nodes_m[:, 2].min()
    assert deepest_m[True] > -0.002
    assert deepest_m[False] < 1.5 * deepest_m[True]


def test_both_arms_hold_and_pull():
    tissue = tissue_of(discs=((0.01, 0.01, 0.03),))
    left_m, right_m = np.array([0.08, 0.04, 0.005]), np.array([0.04, 0.09, 0.005])

    def step(lift_m, jaw):
        return tissue.step(
            {
                "psm1": ToolInput(left_m + lift_m * UP, jaw),
                "psm2": ToolInput(right_m + lift_m * UP, jaw),
            }
        )

    step(0.0, OPEN)
    results = [step(tick * TICK_M, CLOSED) for tick in range(60)]
    assert all(r.solver.converged for r in results)
    result = results[-1]
    assert result.tool_force_n["psm1"][2] > 0.0
    assert result.tool_force_n["psm2"][2] > 0.0
    for arm in ("psm1", "psm2"):
        held = result.grasped[arm]
        assert len(held)
        lifted = result.nodes_m[held, 2] - tissue.mesh.nodes_m[held, 2]
        np.testing.assert_allclose(lifted, 59 * TICK_M, atol=1e-12)


def test_fixed_nodes_are_never_grasped():
    tissue = tissue_of()
    on_a_patch_m = np.array([0.02, 0.02, 0.0])
    result = list(play(tissue, [(on_a_patch_m, OPEN), (on_a_patch_m, CLOSED)]))[-1]
    held = result.grasped["psm1"]
    assert len(held)
    assert not set(held) & set(tissue.fixed_nodes)


def test_a_grasp_out_of_reach_is_empty():
    tissue = tissue_of()
    far_m = np.array([0.05, 0.06, 0.05])
    result = list(play(tissue, [(far_m, OPEN), (far_m, CLOSED)]))[-1]
    assert len(result.grasped["psm1"]) == 0
    assert displacement_m(tissue, result) < 1e-15


def test_same_inputs_same_bits():
    path = [*pull(0.02), *[(TIP_M + 0.02 * UP, OPEN)] * 10]

    def bits(tissue):
        results = list(play(tissue, path))
        return [
            r.nodes_m.tobytes() + r.nodal_force_n.tobytes() + repr(r.solver).encode()
            for r in results
        ]

    tissue = tissue_of()
    first = bits(tissue)
    list(play(tissue_of(young_modulus_pa=5000.0), pull(0.01)))
    assert bits(tissue_of()) == first
    tissue.reset()
    assert bits(tissue) == first


def test_bad_tools_leave_the_tissue_as_it_was():
    tissue, twin = tissue_of(), tissue_of()
    path = list(pull(0.004))
    for tip_m, jaw in path:
        tool = {"psm1": ToolInput(tip_m, jaw)}
        twin.step(tool)
        tissue.step(tool)
        for bad_m in (tip_m * np.nan, tip_m + 0.021 * UP):
            with pytest.raises(BadToolInput):
                tissue.step({"psm1": ToolInput(bad_m, OPEN)})
    next_tool = {"psm1": ToolInput(path[-1][0], CLOSED)}
    assert tissue.step(next_tool).nodes_m.tobytes() == twin.step(next_tool).nodes_m.tobytes()


def test_a_step_that_does_not_converge_keeps_the_state():
    hopeless = SolverOptions(max_iterations=1, step_tolerance_m=1e-15)
    tissue = tissue_of(options=hopeless)
    tissue.measure({"psm1": ToolInput(TIP_M, OPEN)})
    before = tissue.step({"psm1": ToolInput(TIP_M, CLOSED)})
    assert before.solver.converged
    after = tissue.step({"psm1": ToolInput(TIP_M + 0.01 * UP, CLOSED)})
    assert not after.solver.converged
    assert after.solver.residual > 0.0
    np.testing.assert_array_equal(after.nodes_m, before.nodes_m)
    tissue.reset()
    assert tissue.measure({}).solver.converged
    assert tissue.measure({}).grasped == {}


@pytest.mark.parametrize(
    "parameters",
    [
        {"poisson_ratio": 0.5},
        {"density_kg_m3": 0.0},
        {"young_modulus_pa": -1.0},
        {"dt_s": 0.0},
        {"mass_damping_per_s": -1.0},
        {"stiffness_damping_s": float("nan")},
        {"bed_stiffness_pa_m": float("inf")},
    ],
)
def test_impossible_parameters_are_named(parameters):
    (name,) = parameters
    with pytest.raises(BadParameter, match=name) as caught:
        TissueParameters(**parameters)
    assert caught.value.values["name"] == name


def test_impossible_supports_are_named():
    mesh = box_mesh((0.01, 0.01, 0.01), (2, 2, 2))
    with pytest.raises(BadParameter, match="bed = True"):
        TissueSimulator(mesh, TissueParameters(bed=False), [])
    with pytest.raises(BadParameter, match="0 to 7"):
        TissueSimulator(mesh, TissueParameters(), [8])
    with pytest.raises(BadParameter, match="can move"):
        TissueSimulator(mesh, TissueParameters(), np.arange(8))
    with pytest.raises(BadParameter, match="scipy"):
        TissueSimulator(mesh, TissueParameters(), [0], solver="abacus")
    with pytest.raises(BadParameter, match="history"):
        SolverOptions(history=0)
