"""Between messages and the finite-element core: the scene of a scenario, states on the wire."""

import numpy as np
from numpy.typing import NDArray

from fras_common.errors import FrasError
from fras_common.messages import (
    Array,
    HeldNodes,
    RobotState,
    SimCheckpoint,
    SolverReport,
    TissueModel,
    TissueState,
    Vec3,
)
from fras_common.scenario import (
    Scenario,
    SceneSection,
    attachment_raster,
    fit_to_mesh,
    nodes_in_discs,
)
from fras_common.scenario.mesh import SIZE_ROUNDING_M
from fras_sim.fem import (
    ArmState,
    Checkpoint,
    Mesh,
    StepResult,
    TissueParameters,
    TissueSimulator,
    ToolInput,
    box_mesh,
)
from fras_sim.fem.underside import underside_height
from fras_sim.mesh_file import mesh_facts, read_mesh


class UnresolvedScenario(FrasError):
    """A scenario without a scene: whoever starts a trial draws it."""


class MeshMismatch(FrasError):
    """A scenario and the mesh that came with it are not about the same tissue."""


def build_mesh(scenario: Scenario, data: bytes) -> Mesh:
    """Make the mesh of a scenario's tissue: the box, or what the bytes of its mesh file hold.

    Raises
    ------
    MeshMismatch
        Bytes without a mesh file named, or the other way round; another size than the scenario's.
    ScenarioError
        The element is not one for the mesh.
    MeshFileError, BadMesh
        See `mesh_file.read_mesh`.
    """
    tissue = scenario.tissue
    if (tissue.mesh_file is not None) != bool(data):
        raise MeshMismatch(
            f"tissue.mesh_file = {tissue.mesh_file!r} came with {len(data)} bytes of mesh: send a "
            "mesh file's name and its content together"
        )
    if tissue.mesh_file is None:
        return box_mesh(tissue.size_m, tissue.node_counts)
    mesh = read_mesh(data, tissue.mesh_file, tissue.mesh_scale)
    size_m = fit_to_mesh(scenario, mesh_facts(mesh)).tissue.size_m
    if not np.allclose(size_m, tissue.size_m, rtol=0.0, atol=SIZE_ROUNDING_M):
        raise MeshMismatch(
            f"tissue.size_m = {tissue.size_m}, and the mesh's bounding box is {size_m}: fit the "
            "scenario to its mesh before the reset (fras_common.scenario.fit_to_mesh)"
        )
    return mesh


def build_simulator(scenario: Scenario, data: bytes = b"") -> TissueSimulator:
    """Make the tissue of a resolved scenario, at rest.

    Parameters
    ----------
    scenario : Scenario
    data : bytes
        The content of its mesh file, where it names one.

    Raises
    ------
    UnresolvedScenario
        If the scenario has no scene.
    MeshMismatch, ScenarioError, MeshFileError, BadMesh
        See `build_mesh`.
    """
    tissue, scene = scenario.tissue, scenario.scene
    if scene is None:
        raise UnresolvedScenario("the scenario has no scene: resolve it before the reset")
    mesh = build_mesh(scenario, data)
    parameters = TissueParameters(
        young_modulus_pa=tissue.young_modulus_pa,
        poisson_ratio=tissue.poisson_ratio,
        density_kg_m3=tissue.density_kg_m3,
        dt_s=tissue.dt_s,
        gravity=tissue.gravity,
        bed=tissue.bed,
        element=tissue.element,
        material=tissue.material,
    )
    fixed_nodes = nodes_in_discs(mesh.nodes_m, mesh.bottom_nodes, scene.discs)
    return TissueSimulator(mesh, parameters, fixed_nodes)


def fixed_points(mesh: Mesh, scenario: Scenario, scene: SceneSection) -> NDArray[np.float64]:
    """Return the attachment points, shape (n_points, 3) [m].

    On a mesh from a file they lie on its underside; those beside the tissue are left out.
    """
    points_m = attachment_raster(scenario.tissue.size_m, scene.discs)
    if scenario.tissue.mesh_file is None:
        return points_m
    points_m[:, 2] = underside_height(mesh, points_m[:, :2])
    return points_m[np.isfinite(points_m[:, 2])]


def tissue_model(simulator: TissueSimulator, scenario: Scenario, trial: str) -> TissueModel:
    """Describe the tissue at rest."""
    mesh, scene = simulator.mesh, scenario.scene
    if scene is None:
        raise UnresolvedScenario("the scenario has no scene: resolve it before the reset")
    return TissueModel(
        trial=trial,
        tick=0,
        nodes_m=Array.of(mesh.nodes_m, "<f8"),
        elements=Array.of(mesh.elements, "<i4"),
        surface=Array.of(mesh.surface, "<i4"),
        fixed_nodes=Array.of(simulator.fixed_nodes, "<i4"),
        fixed_patch=Array.of(patch_of(simulator), "<i4"),
        fixed_points_m=Array.of(fixed_points(mesh, scenario, scene), "<f8"),
        roi_m=scene.roi_m,
        young_modulus_pa=scenario.tissue.young_modulus_pa,
        poisson_ratio=scenario.tissue.poisson_ratio,
        dt_s=scenario.tissue.dt_s,
    )


def patch_of(simulator: TissueSimulator) -> NDArray[np.int32]:
    """Return the patch of each fixed node, in their order."""
    patch = np.zeros(len(simulator.mesh.nodes_m), dtype=np.int32)
    for number, nodes in enumerate(simulator.patches):
        patch[nodes] = number
    return patch[simulator.fixed_nodes]


def tools_of(robot: RobotState) -> dict[str, ToolInput]:
    """Tips and jaws of the arms."""
    return {
        name: ToolInput(np.array(arm.tip_in_world.position_m), arm.jaw_rad)
        for name, arm in robot.arms.items()
    }


def tissue_state(result: StepResult, tick: int, trial: str, wall_s: float) -> TissueState:
    """Put the result of a step on the wire."""
    report = result.solver
    return TissueState(
        tick=tick,
        trial=trial,
        nodes_m=Array.of(result.nodes_m, "<f4"),
        nodal_force_n=Array.of(result.nodal_force_n, "<f4"),
        max_force_n=result.max_force_n,
        max_node_speed_m_s=result.max_node_speed_m_s,
        tool_force_n={arm: _vec3(force) for arm, force in result.tool_force_n.items()},
        grasped={arm: _ids(nodes) for arm, nodes in result.grasped.items()},
        grasped_force_n={arm: _vec3s(force) for arm, force in result.grasped_force_n.items()},
        patch_force_n=Array.of(result.patch_force_n, "<f4"),
        balance_residual_n=result.balance_residual_n,
        solver=SolverReport(
            iterations=report.iterations,
            residual=report.residual,
            refactored=report.refactored,
            wall_s=wall_s,
            converged=report.converged,
            inverted_elements=report.inverted_elements,
        ),
    )


def checkpoint_message(checkpoint: Checkpoint, trial: str) -> SimCheckpoint:
    """Put a checkpoint on the wire, every bit of it."""
    return SimCheckpoint(
        tick=checkpoint.tick,
        trial=trial,
        nodes_m=Array.of(checkpoint.nodes_m, "<f8"),
        velocity_m_s=Array.of(checkpoint.velocity_m_s, "<f8"),
        support_n=Array.of(checkpoint.support_n, "<f8"),
        balance_residual_n=checkpoint.balance_residual_n,
        arms={
            arm: HeldNodes(
                position_m=_vec3(held.position_m),
                closed=held.closed,
                nodes=_ids(held.nodes),
                offsets_m=_vec3s(held.offsets_m),
            )
            for arm, held in checkpoint.arms.items()
        },
        settling=checkpoint.settling,
    )


def checkpoint_of(message: SimCheckpoint) -> Checkpoint:
    """Take a checkpoint off the wire."""
    return Checkpoint(
        message.tick,
        message.nodes_m.floats(),
        message.velocity_m_s.floats(),
        message.support_n.floats(),
        message.balance_residual_n,
        {
            arm: ArmState(
                np.array(held.position_m),
                held.closed,
                np.array(held.nodes, dtype=np.int32),
                np.array(held.offsets_m).reshape(-1, 3),
            )
            for arm, held in message.arms.items()
        },
        message.settling,
    )


def _ids(nodes: NDArray[np.int32]) -> list[int]:
    return [int(node) for node in nodes]


def _vec3s(rows: NDArray[np.float64]) -> list[Vec3]:
    return [_vec3(row) for row in rows]


def _vec3(values: NDArray[np.float64]) -> Vec3:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
