"""Attachment points (APs) on a raster of their own, so that one scene fits every mesh."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fras_common.scenario.model import Disc

RASTER_M = 0.0025


def bottom_raster(size_m: Sequence[float]) -> NDArray[np.float64]:
    """Centres of the raster cells of the bottom face.

    Parameters
    ----------
    size_m : (3,)
        Extents of the tissue box [m].

    Returns
    -------
    ndarray, shape (n_cells, 2), float64 [m]
        x outermost.
    """
    counts = [max(1, round(extent / RASTER_M)) for extent in size_m[:2]]
    axes = [
        (np.arange(count) + 0.5) * (extent / count)
        for count, extent in zip(counts, size_m[:2], strict=True)
    ]
    x, y = np.meshgrid(*axes, indexing="ij")
    return np.column_stack([x.ravel(), y.ravel()]).astype(np.float64)


def covered(points_m: NDArray[np.float64], discs: Sequence[Disc]) -> NDArray[np.bool_]:
    """Which of `points_m`, shape (n, 2 or 3), lie in a disc (edge included), seen from above."""
    inside = np.zeros(len(points_m), dtype=np.bool_)
    for disc in discs:
        distance = np.hypot(points_m[:, 0] - disc.center_m[0], points_m[:, 1] - disc.center_m[1])
        inside |= distance <= disc.radius_m
    return inside


def attachment_raster(size_m: Sequence[float], discs: Sequence[Disc]) -> NDArray[np.float64]:
    """Raster points that the discs cover, on the bottom face.

    Returns
    -------
    ndarray, shape (n_points, 3), float64 [m]
        With z = 0: the `fixed_points_m` of the tissue model.
    """
    raster = bottom_raster(size_m)
    points = raster[covered(raster, discs)]
    return np.column_stack([points, np.zeros(len(points))])


def nodes_in_discs(
    nodes_m: NDArray[np.float64], bottom_nodes: NDArray[np.int32], discs: Sequence[Disc]
) -> NDArray[np.int32]:
    """Nodes of the bottom face that lie in a disc: those that the attachment fixes.

    Parameters
    ----------
    nodes_m : ndarray, shape (n_nodes, 3), float64 [m]
    bottom_nodes : ndarray, shape (n_bottom,), int32
    discs : sequence of Disc
    """
    return bottom_nodes[covered(nodes_m[bottom_nodes], discs)]
