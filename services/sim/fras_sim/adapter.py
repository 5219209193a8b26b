"""Between messages and the finite-element core: the scene of a scenario, states on the wire."""

import numpy as np
from numpy.typing import NDArray

from fras_common.errors import FrasError
from fras_common.messages import Array, RobotState, SolverReport, TissueModel, TissueState, Vec3
from fras_common.scenario import Scenario, attachment_raster, nodes_in_discs
from fras_sim.fem import StepResult, TissueParameters, TissueSimulator, ToolInput, box_mesh


class UnresolvedScenario(FrasError):
    """A scenario without a scene: whoever starts a trial draws it."""


def build_simulator(scenario: Scenario) -> TissueSimulator:
    """Make the tissue of a resolved scenario, at rest.

    Raises
    ------
    UnresolvedScenario
        If the scenario has no scene.
    """
    tissue, scene = scenario.tissue, scenario.scene
    if scene is None:
        raise UnresolvedScenario("the scenario has no scene: resolve it before the reset")
    mesh = box_mesh(tissue.size_m, tissue.node_counts)
    parameters = TissueParameters(
        young_modulus_pa=tissue.young_modulus_pa,
        poisson_ratio=tissue.poisson_ratio,
        density_kg_m3=tissue.density_kg_m3,
        dt_s=tissue.dt_s,
        gravity=tissue.gravity,
        bed=tissue.bed,
    )
    fixed_nodes = nodes_in_discs(mesh.nodes_m, mesh.bottom_nodes, scene.discs)
    return TissueSimulator(mesh, parameters, fixed_nodes)


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
        fixed_points_m=Array.of(attachment_raster(scenario.tissue.size_m, scene.discs), "<f8"),
        roi_m=scene.roi_m,
        young_modulus_pa=scenario.tissue.young_modulus_pa,
        poisson_ratio=scenario.tissue.poisson_ratio,
        dt_s=scenario.tissue.dt_s,
    )


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
        grasped={arm: [int(node) for node in nodes] for arm, nodes in result.grasped.items()},
        solver=SolverReport(
            iterations=report.iterations,
            residual=report.residual,
            refactored=report.refactored,
            wall_s=wall_s,
            converged=report.converged,
            inverted_elements=report.inverted_elements,
        ),
    )


def _vec3(values: NDArray[np.float64]) -> Vec3:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
