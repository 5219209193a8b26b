"""The underside of a body seen from above: where tissue is, and how high it lies there."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.mesh import Mesh

# Slack with which a point on an edge belongs to both triangles.
BARYCENTRIC_TOLERANCE: Final = 1e-9
# Points times triangles looked at together: a few hundred megabytes at most.
CHUNK: Final = 4_000_000


def underside_height(mesh: Mesh, places_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the height of the lowest surface point on vertical lines.

    Parameters
    ----------
    mesh : Mesh
        At rest.
    places_m : ndarray, shape (n_places, 2), float64 [m]
        x and y of each line.

    Returns
    -------
    ndarray, shape (n_places,), float64 [m]
        NaN where a line misses the body.
    """
    corners_m = mesh.nodes_m[mesh.surface]
    a, first, second = corners_m[:, 0], *np.moveaxis(corners_m[:, 1:] - corners_m[:, :1], 1, 0)
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    longest_m = np.abs(corners_m[:, 1:, :2] - corners_m[:, :1, :2]).max(axis=(1, 2))
    # A vertical line meets walls in their edges only, and those belong to other triangles too.
    flat = np.abs(area) > 1e-9 * longest_m**2
    a, first, second, area = a[flat], first[flat], second[flat], area[flat]
    heights = np.full(len(places_m), np.nan)
    rows = max(1, CHUNK // max(1, len(area)))
    for start in range(0, len(places_m), rows):
        offset = places_m[start : start + rows, None, :] - a[:, :2]
        s = (offset[..., 0] * second[:, 1] - offset[..., 1] * second[:, 0]) / area
        t = (offset[..., 1] * first[:, 0] - offset[..., 0] * first[:, 1]) / area
        hit = np.minimum(np.minimum(s, t), 1.0 - s - t) >= -BARYCENTRIC_TOLERANCE
        z = np.where(hit, a[:, 2] + s * first[:, 2] + t * second[:, 2], np.inf)
        lowest = z.min(axis=1, initial=np.inf)
        heights[start : start + rows] = np.where(np.isfinite(lowest), lowest, np.nan)
    return heights
