"""Compile, or load from numba's cache, everything that a step runs."""

from collections.abc import Iterable

import numpy as np

from fras_sim.fem.cells import TOPOLOGY
from fras_sim.fem.element_kernels import element_kernels
from fras_sim.fem.grasp import ToolInput
from fras_sim.fem.materials import MATERIALS
from fras_sim.fem.mesh import box_mesh
from fras_sim.fem.parameters import TissueParameters
from fras_sim.fem.simulator import TissueSimulator


def compile_kernels(*, everything: bool = False) -> None:
    """Run a tiny grasp and pull, so that no kernel is compiled inside a tick.

    Other elements and materials than the default's load theirs when a simulator is made, never
    later. The first call after an installation takes some seconds and fills numba's cache beside
    the sources (or in the user's cache folder where those are read-only); later ones load it.

    Parameters
    ----------
    everything : bool
        Also compile for every other element and material: a matter of an installation, half a
        minute, so that no trial ever waits for it.
    """
    mesh = box_mesh((0.01, 0.01, 0.01), (3, 3, 2))
    tissue = TissueSimulator(mesh, TissueParameters(), mesh.bottom_nodes)
    tip_m = np.array([0.005, 0.005, 0.01])
    tissue.measure({"psm1": ToolInput(tip_m, 1.0)})
    for lift_m in (0.0, 0.001):
        tissue.step({"psm1": ToolInput(tip_m + np.array([0.0, 0.0, lift_m]), -0.3)})
    if everything:
        for n_nodes, material in _pairs():
            element_kernels(n_nodes, material)


def _pairs() -> Iterable[tuple[int, str]]:
    return ((cell.n_nodes, name) for cell in TOPOLOGY.values() for name in MATERIALS)
