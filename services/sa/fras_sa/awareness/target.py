"""Targets: compute_target in Algorithm 1, where an action is to bring its arm."""

import numpy as np
from numpy.typing import NDArray

from .blocks import Blocks
from .errors import UnknownName
from .views import ACTIONS, FloatArray, RobotView


def compute_target(
    blocks: Blocks, nodes_m: FloatArray, robot: RobotView, *, action: str, arm: str, block: str
) -> NDArray[np.float64] | None:
    """Return the position for the tip of `arm`, or None if the action needs none.

    Parameters
    ----------
    blocks : Blocks
        The candidate grasping points.
    nodes_m : ndarray, shape (n_nodes, 3) [m]
        Current positions of the mesh's nodes.
    robot : RobotView
        The arms now.
    action, arm, block : str
        The action and its arguments; `block` is not looked at where no target is needed.

    Returns
    -------
    ndarray, shape (3,), float64 [m], or None
        reach: where the block is now. move: (x_B, y_B) of the block at rest at the tip's
        present height, the paper's (x_B, y_B, z_i). Grasp, release and pull have none.

    Raises
    ------
    UnknownName
        If the action, arm or block does not exist.
    """
    if action not in ACTIONS:
        raise UnknownName("action", action, ACTIONS)
    if arm not in robot.arms:
        raise UnknownName("arm", arm, sorted(robot.arms))
    if action == "reach":
        return blocks.current(nodes_m)[blocks.row(block)]
    if action == "move":
        x, y, _ = blocks.rest_m[blocks.row(block)]
        return np.array([x, y, float(robot.arms[arm].tip_m[2])])
    return None
