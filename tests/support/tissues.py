"""Tissue made by hand, for whoever listens to the simulator: a box of eight nodes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fras_common.messages import Array, SolverReport, TissueModel, TissueState

CORNERS = np.array(
    [[x, y, z] for z in (0.0, 0.005) for y in (0.0, 0.12) for x in (0.0, 0.1)], dtype=np.float64
)
FACES = np.array(
    [
        *([0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4]),
        *([2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]),
    ]
)


def tissue(tick: int, force_n: float = 0.0, converged: bool = True, **header: Any) -> TissueState:
    fields: dict[str, Any] = {"trial": "t", **header}
    return TissueState(
        tick=tick,
        nodes_m=Array.of(CORNERS, "<f4"),
        nodal_force_n=Array.of(np.zeros_like(CORNERS), "<f4"),
        max_force_n=force_n,
        max_node_speed_m_s=0.0,
        tool_force_n={},
        grasped={"psm1": [1, 2]},
        grasped_force_n={"psm1": [(0.0, 0.0, 0.0)] * 2},
        patch_force_n=Array.of(np.zeros((0, 3)), "<f4"),
        balance_residual_n=0.0,
        solver=SolverReport(
            iterations=1,
            residual=0.0,
            refactored=False,
            wall_s=0.0,
            converged=converged,
            inverted_elements=0,
        ),
        **fields,
    )


def let_alone(
    tick: int,
    nodes_m: NDArray[np.float64],
    force_n: NDArray[np.float64],
    grasped: dict[str, list[int]] | None = None,
    **fields: Any,
) -> TissueState:
    """Tissue of whatever shape that no arm holds, as it stands in a log made by hand."""
    return TissueState(
        tick=tick,
        nodes_m=Array.of(nodes_m, "<f4"),
        nodal_force_n=Array.of(force_n, "<f4"),
        max_node_speed_m_s=0.0,
        tool_force_n={},
        grasped=grasped if grasped is not None else {},
        grasped_force_n={},
        patch_force_n=Array.of(np.zeros((1, 3)), "<f4"),
        balance_residual_n=0.0,
        solver=SolverReport(
            iterations=2, residual=1e-9, refactored=False, wall_s=0.002, converged=True,
            inverted_elements=0,
        ),
        **fields,
    )  # fmt: skip


MODEL = TissueModel(
    tick=0,
    nodes_m=Array.of(CORNERS, "<f8"),
    elements=Array.of(np.arange(8)[None], "<i4"),
    surface=Array.of(FACES, "<i4"),
    fixed_nodes=Array.of(np.zeros(0), "<i4"),
    fixed_patch=Array.of(np.zeros(0), "<i4"),
    fixed_points_m=Array.of(np.zeros((0, 3)), "<f8"),
    roi_m=(0.05, 0.06, 0.0),
    young_modulus_pa=3000.0,
    poisson_ratio=0.45,
    dt_s=0.02,
)
