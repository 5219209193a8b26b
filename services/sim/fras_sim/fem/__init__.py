"""Nonlinear soft tissue by finite elements: a library of its own.

mesh = box_mesh()
tissue = TissueSimulator(mesh, TissueParameters(), fixed_nodes)
tissue.measure({"psm1": ToolInput(tip_m, jaw_rad=1.0)})           # open, at tick 0
result = tissue.step({"psm1": ToolInput(tip_m, jaw_rad=0.0)})     # closes, and grasps
"""

from fras_sim.fem.cells import Cell
from fras_sim.fem.checkpoint import Checkpoint
from fras_sim.fem.errors import (
    BadMesh,
    BadParameter,
    BadToolInput,
    FactorizationFailed,
    FemError,
    NotConverged,
)
from fras_sim.fem.grasp import ArmState, ToolInput
from fras_sim.fem.mesh import Mesh, box_mesh, make_mesh
from fras_sim.fem.parameters import SolverOptions, TissueParameters
from fras_sim.fem.simulator import SolverReport, StepResult, TissueSimulator
from fras_sim.fem.statics import StaticResult, solve_static
from fras_sim.fem.tetrahedra import split_into_tetrahedra, with_midside_nodes
from fras_sim.fem.warmup import compile_kernels

__all__ = [
    "ArmState",
    "BadMesh",
    "BadParameter",
    "BadToolInput",
    "Cell",
    "Checkpoint",
    "FactorizationFailed",
    "FemError",
    "Mesh",
    "NotConverged",
    "SolverOptions",
    "SolverReport",
    "StaticResult",
    "StepResult",
    "TissueParameters",
    "TissueSimulator",
    "ToolInput",
    "box_mesh",
    "compile_kernels",
    "make_mesh",
    "solve_static",
    "split_into_tetrahedra",
    "with_midside_nodes",
]
