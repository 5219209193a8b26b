"""Scenes for the tests of situation awareness: box meshes made here, apart from the simulator."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from fras_sa.awareness import TissueModel

Box = Callable[..., TissueModel]

SIZE_M = (0.1, 0.12, 0.005)


def _faces(counts: Sequence[int], *, flip: bool) -> NDArray[np.intp]:
    ids = np.arange(int(np.prod(counts))).reshape(counts)
    triangles: list[NDArray[np.intp]] = []
    for axis in range(3):
        for end in (0, -1):
            face = np.take(ids, end, axis=axis)
            a, b = face[:-1, :-1].ravel(), face[1:, :-1].ravel()
            c, d = face[1:, 1:].ravel(), face[:-1, 1:].ravel()
            halves = [(a, b, d), (b, c, d)] if flip else [(a, b, c), (a, c, d)]
            triangles += [np.column_stack(half) for half in halves]
    return np.concatenate(triangles)


def _box(
    counts: Sequence[int] = (11, 13, 2),
    *,
    roi: Sequence[float] = (0.05, 0.06, 0.0),
    fixed: Sequence[Sequence[float]] = (),
    origin: Sequence[float] = (0.0, 0.0, 0.0),
    flip: bool = False,
) -> TissueModel:
    axes = [low + np.linspace(0.0, s, n) for low, s, n in zip(origin, SIZE_M, counts, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return TissueModel(
        nodes_m=nodes,
        triangles=_faces(counts, flip=flip),
        fixed_points_m=np.array(fixed, dtype=np.float64).reshape(-1, 3),
        roi_m=np.array(roi, dtype=np.float64),
        dt_s=0.02,
    )


@pytest.fixture(scope="session")
def box() -> Box:
    """Builds the task's box: box(counts, roi=, fixed=, origin=, flip=)."""
    return _box
