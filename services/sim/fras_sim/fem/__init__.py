"""Nonlinear soft tissue by finite elements: a library of its own.

mesh = box_mesh()
tissue = TissueSimulator(mesh, TissueParameters(), fixed_nodes)
result = tissue.step({"psm1": ToolInput(tip_m, jaw_rad)})
"""

from fras_sim.fem.errors import BadMesh, BadParameter, BadToolInput, FactorizationFailed, FemError
from fras_sim.fem.grasp import ToolInput
from fras_sim.fem.mesh import Mesh, box_mesh
from fras_sim.fem.parameters import SolverOptions, TissueParameters
from fras_sim.fem.simulator import SolverReport, StepResult, TissueSimulator
from fras_sim.fem.warmup import compile_kernels

__all__ = [
    "BadMesh",
    "BadParameter",
    "BadToolInput",
    "FactorizationFailed",
    "FemError",
    "Mesh",
    "SolverOptions",
    "SolverReport",
    "StepResult",
    "TissueParameters",
    "TissueSimulator",
    "ToolInput",
    "box_mesh",
    "compile_kernels",
]
