"""A parallel projection with hidden surfaces, because the axes of 3D plots can't show a scene.

Equal scale on all axes by construction; polygons are painted from the farthest to the nearest.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fras_log.anchors import normals

FloatArray = NDArray[np.float64]

ELEVATION_RAD = math.radians(32.0)
AZIMUTHS_RAD = tuple(math.radians(degrees) for degrees in range(-170, 190, 20))
PREFERRED_AZIMUTH_RAD = math.radians(-50.0)


@dataclass(frozen=True)
class Camera:
    """Looks at the scene from afar.

    Parameters
    ----------
    azimuth_rad : float
        Where the camera stands, seen from above, from +x towards +y.
    elevation_rad : float
        Height of the camera above the horizon.
    """

    azimuth_rad: float
    elevation_rad: float = ELEVATION_RAD

    @property
    def axes(self) -> FloatArray:
        """Rows: right, up and towards the camera, in the world frame, shape (3, 3)."""
        ca, sa = math.cos(self.azimuth_rad), math.sin(self.azimuth_rad)
        ce, se = math.cos(self.elevation_rad), math.sin(self.elevation_rad)
        return np.array([[-sa, ca, 0.0], [-ca * se, -sa * se, ce], [ca * ce, sa * ce, se]])

    def project(self, points_m: FloatArray) -> FloatArray:
        """Project world points, shape (..., 3), to right, up and nearness [m], same shape."""
        return points_m @ self.axes.T


def facing(camera: Camera, triangles_m: FloatArray) -> NDArray[np.bool_]:
    """Which triangles, shape (n, 3, 3), wound outwards, show their outside to the camera."""
    return normals(triangles_m) @ camera.axes[2] > 0.0


def seen_share(camera: Camera, points_m: FloatArray, triangles_m: FloatArray) -> float:
    """Share of `points_m`, shape (n, 3), that no triangle hides from the camera."""
    flat = camera.project(triangles_m)
    corners, depth = flat[..., :2], flat[..., 2]
    edge_1, edge_2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    double_area = edge_1[:, 0] * edge_2[:, 1] - edge_1[:, 1] * edge_2[:, 0]
    proper = np.abs(double_area) > 0.0
    edge_1, edge_2, double_area = edge_1[proper], edge_2[proper], double_area[proper]
    origin, depth = corners[proper, 0], depth[proper]
    seen = 0
    for right, up, nearness in camera.project(points_m):
        offset = np.array([right, up]) - origin
        a = (offset[:, 0] * edge_2[:, 1] - offset[:, 1] * edge_2[:, 0]) / double_area
        b = (edge_1[:, 0] * offset[:, 1] - edge_1[:, 1] * offset[:, 0]) / double_area
        covers = (a >= 0.0) & (b >= 0.0) & (a + b <= 1.0)
        cover = depth[:, 0] + a * (depth[:, 1] - depth[:, 0]) + b * (depth[:, 2] - depth[:, 0])
        seen += not bool((covers & (cover > nearness)).any())
    return seen / len(points_m)


def best_camera(points_m: FloatArray, scenes_m: Sequence[FloatArray]) -> Camera:
    """Stand where most of `points_m` is seen past the tissue; if equal, where we like to stand.

    Parameters
    ----------
    points_m : ndarray, shape (n, 3) [m]
    scenes_m : sequence of ndarray, each of shape (m, 3, 3) [m]
        Triangles of the tissue, in each state that will be shown.
    """

    def merit(azimuth_rad: float) -> tuple[float, float]:
        camera = Camera(azimuth_rad)
        share = sum(seen_share(camera, points_m, triangles_m) for triangles_m in scenes_m)
        return round(share, 2), math.cos(azimuth_rad - PREFERRED_AZIMUTH_RAD)

    return Camera(max(AZIMUTHS_RAD, key=merit))
