"""Points that the tissue's upper face carries along: the same material, wherever it went."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def normals(triangles_m: FloatArray) -> FloatArray:
    """Outward unit normals of triangles, shape (n, 3, 3); zero for a degenerate one."""
    first = triangles_m[:, 1] - triangles_m[:, 0]
    second = triangles_m[:, 2] - triangles_m[:, 0]
    product = np.cross(first, second)
    length = np.linalg.norm(product, axis=1, keepdims=True)
    return np.divide(product, length, out=np.zeros_like(product), where=length > 0.0)


def vertex_normals(nodes_m: FloatArray, surface: NDArray[np.integer]) -> FloatArray:
    """Outward unit normal of a surface at each node, shape (n_nodes, 3); zero inside the body."""
    corners_m = nodes_m[surface]
    # Not normalised: a large face counts more than a small one.
    across = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    total = np.stack(
        [
            np.bincount(surface.ravel(), np.repeat(across[:, axis], 3), len(nodes_m))
            for axis in range(3)
        ],
        axis=-1,
    )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.divide(total, length, out=np.zeros_like(total), where=length > 0.0)


@dataclass(frozen=True, eq=False)
class Anchors:
    """Where points are bound to the mesh.

    Parameters
    ----------
    points : ndarray of int, shape (n,)
        Which of the points that were to be bound; those beside the tissue are left out.
    corners : ndarray of int, shape (n, 3)
        Nodes of the triangle that each is bound to.
    weights : ndarray, shape (n, 3)
        Its place in that triangle.
    """

    points: NDArray[np.intp]
    corners: NDArray[np.intp]
    weights: FloatArray

    def places(self, nodes_m: FloatArray) -> FloatArray:
        """Where they are when the nodes are at `nodes_m`, shape (n, 3) [m]."""
        return np.einsum("nk,nkx->nx", self.weights, nodes_m[self.corners])

    def upward(self, nodes_m: FloatArray) -> FloatArray:
        """Outward normal of the tissue there, shape (n, 3)."""
        return normals(nodes_m[self.corners])


def bind(rest_m: FloatArray, surface: NDArray[np.integer], points_m: FloatArray) -> Anchors:
    """Bind points to the highest place of the surface above or below each.

    Parameters
    ----------
    rest_m : ndarray, shape (n_nodes, 3) [m]
        Nodes at rest.
    surface : ndarray of int, shape (n_triangles, 3)
        Outer faces, wound outwards.
    points_m : ndarray, shape (n, 2 or 3) [m]
        As they lie over the tissue at rest.
    """
    top = surface[normals(rest_m[surface])[:, 2] > 0.5].astype(np.intp)
    at_rest = rest_m[top]
    origin, edge_1, edge_2 = (
        at_rest[:, 0],
        at_rest[:, 1] - at_rest[:, 0],
        at_rest[:, 2] - at_rest[:, 0],
    )
    double_area = edge_1[:, 0] * edge_2[:, 1] - edge_1[:, 1] * edge_2[:, 0]
    bound: list[int] = []
    triangles: list[int] = []
    weights: list[tuple[float, float, float]] = []
    for index, point in enumerate(points_m):
        offset = point[:2] - origin[:, :2]
        b = (offset[:, 0] * edge_2[:, 1] - offset[:, 1] * edge_2[:, 0]) / double_area
        c = (edge_1[:, 0] * offset[:, 1] - edge_1[:, 1] * offset[:, 0]) / double_area
        over = np.flatnonzero((b >= -1e-9) & (c >= -1e-9) & (b + c <= 1.0 + 1e-9))
        if over.size:
            height_m = origin[over, 2] + b[over] * edge_1[over, 2] + c[over] * edge_2[over, 2]
            best = over[np.argmax(height_m)]
            bound.append(index)
            triangles.append(int(best))
            weights.append((1.0 - float(b[best]) - float(c[best]), float(b[best]), float(c[best])))
    return Anchors(
        points=np.array(bound, dtype=np.intp),
        corners=top[triangles].reshape(-1, 3),
        weights=np.array(weights, dtype=np.float64).reshape(-1, 3),
    )
