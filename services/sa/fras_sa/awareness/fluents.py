"""Fluents with their evidence: compute_fluents, Algorithm 2 of the paper.

Fluents are text as the planner grounds it, time left out. Beside each stand the numbers that
made it true. `visible_roi` and the force have an entry even where they don't hold, with the
margin (negative: by how much it is missed).

Two readings of the algorithm, both in the paper's text rather than in its listing: an attachment
point must lie in the block b (the listing says in B, the set of all blocks), and y_i in
`reachable` is the arm's base, so that each arm has its half of the tissue.

`in_hand` is the paper's: at the block and closed. Whether the jaws caught any tissue is not
asked here; a grasp that caught none fails in motion, so the planner never builds on one.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from .blocks import Blocks
from .parameters import AwarenessParameters
from .views import ARMS, ArmView, Evidence, FloatArray, RobotView, TissueModel

SIDE_TOLERANCE_M = 1e-9
"""A block on the tissue's middle line belongs to psm2, whatever its rounding."""

Fluents = dict[str, Evidence]
"""Fluents that hold, in order, each with its evidence."""


def scene_fluents(blocks: Blocks, model: TissueModel) -> Fluents:
    """Return what depends on the scene at rest alone: above_roi, reachable, fixed.

    Parameters
    ----------
    blocks : Blocks
        The candidate grasping points.
    model : TissueModel
        The scene at rest.

    Returns
    -------
    dict of str to dict of str to float
    """
    fluents: Fluents = {}
    roi = np.asarray(model.roi_m, dtype=np.float64)
    for row in blocks.rows_at(roi[None]):
        if row >= 0:
            fluents[f"above_roi({blocks.names[row]})"] = above_roi_evidence(blocks, row, roi)
    for row, name in enumerate(blocks.names):
        evidence = reachable_evidence(blocks, row)
        lower = evidence["rest_y_m"] < evidence["middle_y_m"] - SIDE_TOLERANCE_M
        fluents[f"reachable({ARMS[0] if lower else ARMS[1]},{name})"] = evidence
    rows = blocks.rows_at(model.fixed_points_m)
    for row, count in zip(*np.unique(rows[rows >= 0], return_counts=True), strict=True):
        fluents[f"fixed({blocks.names[row]})"] = fixed_evidence(count)
    return fluents


def gripper_fluents(parameters: AwarenessParameters, robot: RobotView) -> Fluents:
    """Return which grippers are closed."""
    return {
        f"closed_gripper({name})": jaw_evidence(parameters, arm)
        for name, arm in sorted(robot.arms.items())
        if arm.jaw_rad < parameters.closed_jaw_rad
    }


def location_fluents(
    parameters: AwarenessParameters, blocks: Blocks, nodes_m: FloatArray, robot: RobotView
) -> Fluents:
    """Return at which blocks the arms are, and which they have in hand.

    Distances are to where the block is now, so a block that is held stays held while the tissue
    follows the tip.
    """
    current = blocks.current(nodes_m)
    fluents: Fluents = {}
    for name, arm in sorted(robot.arms.items()):
        apart = distances(current, arm.tip_m)
        for row in np.flatnonzero(apart < parameters.at_distance_m):
            evidence = distance_evidence(parameters, apart[row])
            fluents[f"at({name},{blocks.names[row]})"] = evidence
            if arm.jaw_rad < parameters.closed_jaw_rad:
                grip = evidence | jaw_evidence(parameters, arm)
                fluents[f"in_hand({name},{blocks.names[row]})"] = grip
    return fluents


def max_height_fluents(arms: Iterable[str], visibility: Evidence, force: Evidence) -> Fluents:
    """Return which arms may not pull on, with what is seen and borne now."""
    return {f"max_height({arm})": max_height_evidence(visibility, force) for arm in sorted(arms)}


def above_roi_evidence(blocks: Blocks, row: int, roi_m: FloatArray) -> Evidence:
    """Return where the ROI lies, seen from a block's centre, and how far the block goes."""
    offset = roi_m[:2] - blocks.rest_m[row, :2]
    return {
        "roi_offset_x_m": float(offset[0]),
        "roi_offset_y_m": float(offset[1]),
        "half_cell_x_m": float(0.5 * blocks.cell_m[0]),
        "half_cell_y_m": float(0.5 * blocks.cell_m[1]),
    }


def reachable_evidence(blocks: Blocks, row: int) -> Evidence:
    """Return on which side of the tissue a block lies."""
    return {"rest_y_m": float(blocks.rest_m[row, 1]), "middle_y_m": blocks.middle_y_m}


def fixed_evidence(points: int) -> Evidence:
    """Return how many attachment points lie in a block."""
    return {"fixed_points": float(points)}


def jaw_evidence(parameters: AwarenessParameters, arm: ArmView) -> Evidence:
    """Return a jaw's opening, and below which it is closed."""
    return {"jaw_rad": arm.jaw_rad, "closed_jaw_rad": parameters.closed_jaw_rad}


def distance_evidence(parameters: AwarenessParameters, distance_m: float) -> Evidence:
    """Return how far a tip is from a block, and nearer than what it is at it."""
    return {"distance_m": float(distance_m), "at_distance_m": parameters.at_distance_m}


def max_height_evidence(visibility: Evidence, force: Evidence) -> Evidence:
    """Return what is seen and borne now."""
    return {
        "visible_fraction": visibility["visible_fraction"],
        "threshold_fraction": visibility["threshold_fraction"],
        "force_n": force["force_n"],
        "limit_n": force["limit_n"],
    }


def visibility_evidence(parameters: AwarenessParameters, fraction: float) -> Evidence:
    """Return the numbers behind `visible_roi` or its absence."""
    return {
        "holds": float(fraction > parameters.visible_fraction),
        "visible_fraction": fraction,
        "threshold_fraction": parameters.visible_fraction,
        "margin_fraction": fraction - parameters.visible_fraction,
    }


def force_evidence(parameters: AwarenessParameters, force_n: float) -> Evidence:
    """Return the force against its limits; `enforced` is 0 where no limit binds."""
    return {
        "holds": float(force_n <= parameters.force_limit_n),
        "force_n": force_n,
        "limit_n": parameters.force_limit_n,
        "hard_limit_n": parameters.hard_n,
        "margin_n": parameters.force_limit_n - force_n,
        "enforced": float(not parameters.no_limit),
    }


def distances(points: NDArray[np.float64], tip: FloatArray) -> NDArray[np.float64]:
    """Return how far each point is from the tip [m]."""
    offset = points - tip
    return np.sqrt((offset * offset).sum(axis=1))
