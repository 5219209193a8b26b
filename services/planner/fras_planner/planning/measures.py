"""Distances that the rules rank blocks by, as whole millimetres; and the bounds they must keep.

Distances are geometry, not knowledge: what they are worth is said in `asp/preferences/`.
"""

import re

import numpy as np
from numpy.typing import NDArray

from fras_planner.planning.errors import EmptyContext, SceneOutOfBounds
from fras_planner.planning.scene import PlanningScene

INT32_MAX = 2**31 - 1
MAX_BLOCKS = 10_000
MAX_COORDINATE_M = 10.0
# Criteria may weigh a distance: leave room for a factor of two, and for the difference of two.
HEADROOM = 4
ROWS_AT_A_TIME = 256
NAME = re.compile(r"b\([1-9][0-9]{0,4},[1-9][0-9]{0,4}\)")


def whole_mm(distances_m: NDArray[np.float64]) -> NDArray[np.int64]:
    """Round metres half up to millimetres; noise below a nanometre does not decide a half."""
    return np.floor(np.round(distances_m * 1e3, 6) + 0.5).astype(np.int64)


def check_bounds(scene: PlanningScene) -> None:
    """Refuse a scene that is malformed, or whose scores could leave 32-bit integers.

    Clingo's integers overflow silently, so this comes before any grounding.

    Raises
    ------
    EmptyContext, SceneOutOfBounds
    """
    names, n = scene.names, len(scene.names)
    if not n:
        raise EmptyContext("blocks")
    if n > MAX_BLOCKS:
        raise SceneOutOfBounds("number of blocks", n, f"at most {MAX_BLOCKS}")
    if len(scene.blocks_m) != n:
        raise SceneOutOfBounds(
            "rows of blocks_m", len(scene.blocks_m), f"one for each of {n} names"
        )
    for name in names:
        if not NAME.fullmatch(name):
            raise SceneOutOfBounds("block name", name, "must read b(i,j) with i, j from 1")
    if len(set(names)) != n:
        raise SceneOutOfBounds("block names", "repeated", "each may stand once")
    for quantity, point in [*zip(names, scene.blocks_m, strict=True), ("roi_m", scene.roi_m)]:
        if len(point) != 3 or not all(abs(value) <= MAX_COORDINATE_M for value in point):
            allowed = f"three finite coordinates within {MAX_COORDINATE_M} m"
            raise SceneOutOfBounds(quantity, point, allowed)
    diagonal_m = np.linalg.norm(np.ptp(np.array([*scene.blocks_m, scene.roi_m]), axis=0))
    longest_sum_mm = (int(diagonal_m * 1e3) + 1) * (n + 1)
    if HEADROOM * longest_sum_mm > INT32_MAX:
        allowed = f"at most {INT32_MAX // HEADROOM}"
        raise SceneOutOfBounds("sum of distances [mm]", longest_sum_mm, allowed)


def measures(scene: PlanningScene, fixed: list[str], *, sums: bool) -> dict[str, list[int]]:
    """Distances of each block, by the predicate that carries them.

    Parameters
    ----------
    scene : PlanningScene
    fixed : list of str
        Blocks over attachment points.
    sums : bool
        Whether the sums over all attachments are wanted too (all pairs: O(n^2) memory traffic).

    Returns
    -------
    dict of str to list of int
        In the order of the blocks [mm]. `roi_distance` in the plane, since the region of interest
        lies under the tissue; to attachments between rest centres; 0 where none is fixed.
    """
    blocks = np.array(scene.blocks_m, dtype=np.float64).reshape(-1, 3)
    roi = np.array(scene.roi_m, dtype=np.float64)
    offsets = blocks[:, :2] - roi[:2]
    found = {"roi_distance": whole_mm(np.hypot(offsets[:, 0], offsets[:, 1]))}
    row = {name: index for index, name in enumerate(scene.names)}
    anchors = blocks[[row[name] for name in fixed]]
    kinds = ["nearest_attachment"]
    if sums:
        kinds += ["attachment_distance_sum", "attachment_distance_set_sum"]
    for kind in kinds:
        found[kind] = np.zeros(len(blocks), dtype=np.int64)
    if len(anchors):
        for start in range(0, len(blocks), ROWS_AT_A_TIME):
            part = slice(start, start + ROWS_AT_A_TIME)
            d = whole_mm(np.linalg.norm(blocks[part, None, :] - anchors[None, :, :], axis=2))
            found["nearest_attachment"][part] = d.min(axis=1)
            if sums:
                d.sort(axis=1)
                fresh = np.diff(d, axis=1, prepend=-1) != 0
                found["attachment_distance_sum"][part] = d.sum(axis=1)
                found["attachment_distance_set_sum"][part] = (d * fresh).sum(axis=1)
    return {kind: values.tolist() for kind, values in found.items()}
