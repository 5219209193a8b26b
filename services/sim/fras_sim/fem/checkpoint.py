"""Everything that a step starts from, as values that can be kept and sent."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.grasp import ArmState


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """The state of a simulator after a tick; see `TissueSimulator.checkpoint`.

    Parameters
    ----------
    tick : int
        Steps since the last reset.
    nodes_m, velocity_m_s : ndarray, shape (n_nodes, 3), float64
    support_n : ndarray, shape (n_nodes, 3), float64 [N]
        What supports and tools exerted in the last step.
    balance_residual_n : float
        That of the last step.
    arms : mapping of ArmState
        Every known tool, and what it holds.
    settling : bool
        Whether a release was the last thing the tools did.
    """

    tick: int
    nodes_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]
    support_n: NDArray[np.float64]
    balance_residual_n: float
    arms: Mapping[str, ArmState]
    settling: bool
