"""Blocks: the finite set of candidate grasping points, `discretize` in Algorithm 2.

The tissue's bounding box, seen from above, is cut into N x N cells. A block is the cell and the
material point at its centre on the top face: the cell answers what lies in the block at rest,
the material point where the block is now.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import NoBlocks, UnknownName
from .views import FloatArray, TissueModel

EDGE_TOLERANCE_M = 1e-7
"""A point this close below a cell's upper edge counts as on it.

Rest positions may have passed through float32 (4 nm at 0.1 m); without the slack an attachment
point on an edge would fall into either cell as rounding has it.
"""

BARYCENTRIC_TOLERANCE = 1e-9
"""Slack with which a point on an edge belongs to both triangles."""


@dataclass(frozen=True, slots=True, eq=False)
class Blocks:
    """The blocks of one tissue, in row order (i along x first).

    Parameters
    ----------
    names : tuple of str
        `b(i,j)`, i along x and j along y, from 1.
    rest_m : ndarray, shape (n_blocks, 3), float64 [m]
        Rest centres on the top face.
    corners : ndarray of int, shape (3, n_blocks)
        Nodes of the surface triangle that each block is bound to.
    barycentric : ndarray, shape (3, n_blocks), float64
        Its place in that triangle.
    lower_m, cell_m : ndarray, shape (2,), float64 [m]
        Corner of the grid and size of a cell, in x and y.
    rows : ndarray of int, shape (N, N)
        Row of the block of cell (i-1, j-1); -1 where the cell was dropped.
    """

    names: tuple[str, ...]
    rest_m: NDArray[np.float64]
    corners: NDArray[np.intp]
    barycentric: NDArray[np.float64]
    lower_m: NDArray[np.float64]
    cell_m: NDArray[np.float64]
    rows: NDArray[np.intp]

    def __len__(self) -> int:
        return len(self.names)

    @property
    def middle_y_m(self) -> float:
        """Half of the tissue's extent along y [m], where the arms' sides meet."""
        return float(self.lower_m[1] + 0.5 * self.cell_m[1] * self.rows.shape[1])

    def current(self, nodes_m: FloatArray) -> NDArray[np.float64]:
        """Return where the blocks are on the deformed face.

        Parameters
        ----------
        nodes_m : ndarray, shape (n_nodes, 3) [m]
            Current positions of the mesh's nodes.

        Returns
        -------
        ndarray, shape (n_blocks, 3), float64 [m]
        """
        first, second, third = self.barycentric[:, :, None]
        a, b, c = self.corners
        return first * nodes_m[a] + second * nodes_m[b] + third * nodes_m[c]

    def row(self, name: str) -> int:
        """Return the row of the block called `name`.

        Raises
        ------
        UnknownName
            If there is none of that name.
        """
        try:
            return self.names.index(name)
        except ValueError:
            raise UnknownName("block", name, self.names) from None

    def rows_at(self, points_m: FloatArray) -> NDArray[np.intp]:
        """Return in which block's cell each point lies, seen from above.

        Cells are half open, the last of each row closed, so that each point of the tissue has
        exactly one.

        Parameters
        ----------
        points_m : ndarray, shape (n_points, 2 or 3) [m]

        Returns
        -------
        ndarray of int, shape (n_points,)
            Row of the block; -1 outside the grid and in dropped cells.
        """
        offset = np.asarray(points_m, dtype=np.float64)[:, :2] - self.lower_m
        count = self.rows.shape[0]
        upper = self.cell_m * count
        inside = np.all((offset >= -EDGE_TOLERANCE_M) & (offset <= upper + EDGE_TOLERANCE_M), 1)
        cell = np.floor((offset[inside] + EDGE_TOLERANCE_M) / self.cell_m).astype(np.intp)
        cell = np.clip(cell, 0, count - 1)
        result = np.full(len(offset), -1, dtype=np.intp)
        result[inside] = self.rows[cell[:, 0], cell[:, 1]]
        return result


def make_blocks(model: TissueModel, count: int) -> Blocks:
    """Cut the tissue's rest surface into `count` x `count` blocks.

    A cell whose centre has no surface above or below it is dropped: there is nothing to grasp.

    Parameters
    ----------
    model : TissueModel
        The scene at rest.
    count : int
        N, blocks along each side.

    Returns
    -------
    Blocks

    Raises
    ------
    NoBlocks
        If every cell was dropped.
    """
    nodes = np.asarray(model.nodes_m, dtype=np.float64)
    triangles = np.asarray(model.triangles, dtype=np.intp)
    surface = nodes[np.unique(triangles)]
    lower = surface[:, :2].min(axis=0)
    cell = (surface[:, :2].max(axis=0) - lower) / count
    top = _TopFace(nodes, triangles)

    names: list[str] = []
    rest: list[NDArray[np.float64]] = []
    corners: list[NDArray[np.intp]] = []
    places: list[NDArray[np.float64]] = []
    rows = np.full((count, count), -1, dtype=np.intp)
    for i in range(count):
        for j in range(count):
            centre = lower + (np.array([i, j]) + 0.5) * cell
            hit = top.below(centre)
            if hit is None:
                continue
            triangle, barycentric, height = hit
            rows[i, j] = len(names)
            names.append(f"b({i + 1},{j + 1})")
            rest.append(np.append(centre, height))
            corners.append(triangles[triangle])
            places.append(barycentric)
    if not names:
        raise NoBlocks(count)
    rest_m = np.array(rest)
    rest_m.setflags(write=False)
    return Blocks(
        names=tuple(names),
        rest_m=rest_m,
        corners=np.ascontiguousarray(np.array(corners).T),
        barycentric=np.ascontiguousarray(np.array(places).T),
        lower_m=lower,
        cell_m=cell,
        rows=rows,
    )


class _TopFace:
    """Finds the highest surface point on a vertical line."""

    def __init__(self, nodes: NDArray[np.float64], triangles: NDArray[np.intp]) -> None:
        a, b, c = (nodes[triangles[:, corner]] for corner in range(3))
        first, second = b[:, :2] - a[:, :2], c[:, :2] - a[:, :2]
        area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
        size = np.maximum(np.abs(first).max(axis=1), np.abs(second).max(axis=1))
        # Walls have no extent seen from above; a vertical line never hits them cleanly.
        self._kept = np.flatnonzero(np.abs(area) > 1e-9 * size**2)
        self._origin = a[self._kept, :2]
        inverse = 1.0 / area[self._kept, None]
        self._to_second = np.column_stack([second[:, 1], -second[:, 0]])[self._kept] * inverse
        self._to_third = np.column_stack([-first[:, 1], first[:, 0]])[self._kept] * inverse
        self._heights = np.column_stack([a[:, 2], b[:, 2], c[:, 2]])[self._kept]

    def below(self, point: NDArray[np.float64]) -> tuple[int, NDArray[np.float64], float] | None:
        """Return triangle, barycentric coordinates and height of the topmost hit, or None."""
        offset = point - self._origin
        second = (self._to_second * offset).sum(axis=1)
        third = (self._to_third * offset).sum(axis=1)
        places = np.column_stack([1.0 - second - third, second, third])
        hits = np.flatnonzero(places.min(axis=1) >= -BARYCENTRIC_TOLERANCE)
        if hits.size == 0:
            return None
        heights = (places[hits] * self._heights[hits]).sum(axis=1)
        best = int(np.argmax(heights))
        hit = hits[best]
        return int(self._kept[hit]), places[hit], float(heights[best])
