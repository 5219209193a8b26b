"""Visibility of the ROI: which share of the tissue that hid it has gone (Algorithm 2, lines 7-8).

The paper counts tissue points, which would make the answer depend on how fine the mesh is. Here
P_close is sampled evenly from the surface: each surface triangle is cut into n^2 congruent
triangles with edges no longer than a given length, and their centroids carry their areas as
weights. The mesh's density then cancels out.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import NoTissueNearRoi
from .views import FloatArray, TissueModel

REST_MARGIN_M = 1e-7
"""How much nearer than the limit a point must be at rest to count as close.

States may pass through float32; a point right on the limit would come back on its other side,
and a tissue at rest would seem to show some of the ROI.
"""


@dataclass(frozen=True, slots=True, eq=False)
class ClosePoints:
    """P_close: the surface points that hide the ROI at rest, fixed at the start of the task.

    Parameters
    ----------
    corners : ndarray of int, shape (3, n_points)
        Nodes of the triangle that each point lies in.
    barycentric : ndarray, shape (3, n_points), float64
        Its place in that triangle.
    weights : ndarray, shape (n_points,), float64
        Share of the hiding area that it stands for; the sum is 1.
    roi_m : ndarray, shape (3,), float64 [m]
        The ROI.
    distance_m : float [m]
        Farther than this from the ROI, a point no longer hides it.
    """

    corners: NDArray[np.intp]
    barycentric: NDArray[np.float64]
    weights: NDArray[np.float64]
    roi_m: NDArray[np.float64]
    distance_m: float

    def visible_fraction(self, nodes_m: FloatArray) -> float:
        """Return |P_v| / |P_close|, by area at rest.

        Parameters
        ----------
        nodes_m : ndarray, shape (n_nodes, 3) [m]
            Current positions of the mesh's nodes.

        Returns
        -------
        float
            Between 0 (hidden as at rest) and 1.
        """
        offset = nodes_m - self.roi_m
        squared = np.zeros(len(self.weights))
        # By column and elementwise: no matrix product, whose sum would depend on the BLAS.
        for axis in range(3):
            column = offset[:, axis]
            along = self.barycentric[0] * column[self.corners[0]]
            along += self.barycentric[1] * column[self.corners[1]]
            along += self.barycentric[2] * column[self.corners[2]]
            squared += along * along
        return float(np.sum(self.weights, where=squared > self.distance_m**2))


def make_close_points(model: TissueModel, distance_m: float, edge_m: float) -> ClosePoints:
    """Sample the rest surface around the ROI and keep what lies closer than `distance_m`.

    Parameters
    ----------
    model : TissueModel
        The scene at rest.
    distance_m : float [m]
        The paper's 10 mm.
    edge_m : float [m]
        Longest edge of a sampled triangle.

    Returns
    -------
    ClosePoints

    Raises
    ------
    NoTissueNearRoi
        If nothing hides the ROI.
    """
    nodes = np.asarray(model.nodes_m, dtype=np.float64)
    roi = np.asarray(model.roi_m, dtype=np.float64)
    triangles = np.asarray(model.triangles, dtype=np.intp)
    near = _near(nodes[triangles], roi, distance_m)
    triangles = triangles[near]
    vertices = nodes[triangles]
    edges = np.linalg.norm(vertices - np.roll(vertices, 1, axis=1), axis=2).max(axis=1)
    # Rounding must not turn an exact multiple into one more division.
    divisions = np.maximum(1, np.ceil(edges / edge_m - 1e-6).astype(np.intp))
    normals = np.cross(vertices[:, 1] - vertices[:, 0], vertices[:, 2] - vertices[:, 0])
    areas = 0.5 * np.linalg.norm(normals, axis=1)

    owners: list[NDArray[np.intp]] = [np.empty(0, dtype=np.intp)]
    places: list[NDArray[np.float64]] = [np.empty((0, 3))]
    for count in np.unique(divisions):
        members = np.flatnonzero(divisions == count)
        centroids = _centroids(int(count))
        owners.append(np.repeat(members, len(centroids)))
        places.append(np.tile(centroids, (len(members), 1)))
    owner, place = np.concatenate(owners), np.concatenate(places)
    points = np.einsum("nc,ncx->nx", place, vertices[owner])
    close = np.linalg.norm(points - roi, axis=1) < distance_m - REST_MARGIN_M
    owner, place = owner[close], place[close]
    weights = areas[owner] / divisions[owner] ** 2
    if not weights.sum() > 0.0:
        raise NoTissueNearRoi([float(value) for value in roi], distance_m)
    return ClosePoints(
        corners=np.ascontiguousarray(triangles[owner].T),
        barycentric=np.ascontiguousarray(place.T),
        weights=weights / math.fsum(weights),
        roi_m=roi,
        distance_m=distance_m,
    )


def _near(
    vertices: NDArray[np.float64], roi: NDArray[np.float64], distance_m: float
) -> NDArray[np.bool_]:
    """Return which triangles can have a point within `distance_m` of the ROI.

    A triangle lies within the sphere about its centroid through its farthest vertex.
    """
    centroids = vertices.mean(axis=1)
    radii = np.linalg.norm(vertices - centroids[:, None], axis=2).max(axis=1)
    return np.linalg.norm(centroids - roi, axis=1) <= distance_m + radii


def _centroids(count: int) -> NDArray[np.float64]:
    """Return the barycentric centroids of the count^2 congruent parts of a triangle.

    Each edge is cut into `count`; cell (i, j) of the skew grid holds an upright part with its
    centroid at (i + 1/3, j + 1/3) and, but for the last of each row, an inverted one at
    (i + 2/3, j + 2/3), in units of 1 / count.
    """
    grid_i, grid_j = np.divmod(np.arange(count * count), count)
    upright = grid_i + grid_j < count
    inverted = grid_i + grid_j < count - 1
    first = np.concatenate([grid_i[upright] + 1 / 3, grid_i[inverted] + 2 / 3]) / count
    second = np.concatenate([grid_j[upright] + 1 / 3, grid_j[inverted] + 2 / 3]) / count
    return np.column_stack([1.0 - first - second, first, second])
