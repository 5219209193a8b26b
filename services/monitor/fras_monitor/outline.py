"""The edge of a patch that is known as points of a raster."""

from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from fras_common.scenario.geometry import RASTER_M

FloatArray = NDArray[np.float64]

# Of a cell: its neighbour beyond each side, and the ends of that side in half cells.
_SIDES = (
    ((1, 0), ((1, -1), (1, 1))),
    ((-1, 0), ((-1, 1), (-1, -1))),
    ((0, 1), ((1, 1), (-1, 1))),
    ((0, -1), ((-1, -1), (1, -1))),
)
_SAME = 1e-6
"""Coordinates that differ by less [m] are one."""


def outline(points_m: FloatArray) -> FloatArray:
    """Return where a patch ends, as closed lines.

    Parameters
    ----------
    points_m : ndarray, shape (n, 3) [m]
        Middles of cells of a raster along x and y, not all of which need be there.

    Returns
    -------
    ndarray, shape (m, 2, 3) [m]
        Pieces, at the heights of the points that they bound.

    Notes
    -----
    From the middle of each side beyond which there is no cell to that of the next one, so that
    the raster's stairs are cut, by less than half a cell.
    """
    if not len(points_m):
        return np.zeros((0, 2, 3))
    pitch_m = np.array([_pitch_m(points_m[:, axis]) for axis in (0, 1)])
    cells = np.rint((points_m[:, :2] - points_m[:, :2].min(axis=0)) / pitch_m).astype(np.int64)
    there = {(x, y) for x, y in cells.tolist()}
    # Two sides meet at a corner, or four where two cells touch: then the two of each cell.
    at_corner: dict[tuple[int, int], list[FloatArray]] = defaultdict(list)
    for middle_m, (x, y) in zip(points_m, cells.tolist(), strict=True):
        for (right, up), ends in _SIDES:
            if (x + right, y + up) not in there:
                side_m = middle_m + 0.5 * np.array([*(pitch_m * (right, up)), 0.0])
                for across, along in ends:
                    at_corner[2 * x + across, 2 * y + along].append(side_m)
    pieces = [sides[i : i + 2] for sides in at_corner.values() for i in range(0, len(sides), 2)]
    return np.array(pieces).reshape(-1, 2, 3)


def _pitch_m(along_m: FloatArray) -> float:
    """Return the smallest step of a raster along one axis; the usual one where there is none."""
    steps = np.diff(np.sort(along_m))
    steps = steps[steps > _SAME]
    return float(steps.min()) if len(steps) else RASTER_M
