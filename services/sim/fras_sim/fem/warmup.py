"""Compile, or load from numba's cache, everything that a step runs."""

import numpy as np

from fras_sim.fem.grasp import ToolInput
from fras_sim.fem.mesh import box_mesh
from fras_sim.fem.parameters import TissueParameters
from fras_sim.fem.simulator import TissueSimulator


def compile_kernels() -> None:
    """Run a tiny grasp and pull, so that no kernel is compiled inside a tick.

    The first call after an installation takes about 6 s and fills numba's cache beside the
    sources (or in the user's cache folder where those are read-only); later ones load it.
    """
    mesh = box_mesh((0.01, 0.01, 0.01), (3, 3, 2))
    tissue = TissueSimulator(mesh, TissueParameters(), mesh.bottom_nodes)
    tip_m = np.array([0.005, 0.005, 0.01])
    tissue.measure({"psm1": ToolInput(tip_m, 1.0)})
    for lift_m in (0.0, 0.001):
        tissue.step({"psm1": ToolInput(tip_m + np.array([0.0, 0.0, lift_m]), -0.3)})
