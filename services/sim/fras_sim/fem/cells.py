"""The kinds of finite elements by their topology: faces, edges, node order (VTK's)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Cell = Literal["hex8", "tet4", "tet10"]
Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Topology:
    """Local node ids of one kind of element.

    Parameters
    ----------
    n_nodes : int
    faces : ndarray, shape (n_faces, n_face_nodes)
        Each wound so that its normal points outward; corners first, then midside nodes.
    face_triangles : ndarray, shape (n_triangles, 3)
        Places within a face whose nodes make the triangles that cover it.
    edges : ndarray, shape (n_edges, 2)
        Pairs of neighbours: a midside node splits its edge in two.
    """

    n_nodes: int
    faces: Ids
    face_triangles: Ids
    edges: Ids


def _pairs(*ids: int) -> Ids:
    return np.array(ids).reshape(-1, 2)


TOPOLOGY: dict[Cell, Topology] = {
    "hex8": Topology(
        n_nodes=8,
        faces=np.array(
            [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
        ),
        face_triangles=np.array([[0, 1, 2], [0, 2, 3]]),
        edges=_pairs(0, 1, 1, 2, 2, 3, 3, 0, 4, 5, 5, 6, 6, 7, 7, 4, 0, 4, 1, 5, 2, 6, 3, 7),
    ),
    "tet4": Topology(
        n_nodes=4,
        faces=np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]),
        face_triangles=np.array([[0, 1, 2]]),
        edges=_pairs(0, 1, 1, 2, 2, 0, 0, 3, 1, 3, 2, 3),
    ),
    "tet10": Topology(
        n_nodes=10,
        faces=np.array(
            [[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [2, 0, 3, 6, 7, 9]]
        ),
        face_triangles=np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]),
        edges=_pairs(0, 4, 4, 1, 1, 5, 5, 2, 2, 6, 6, 0, 0, 7, 7, 3, 1, 8, 8, 3, 2, 9, 9, 3),
    ),
}
