"""Simple meshes of our own: instruments with jaws, rings, dashed paths. Metres, world frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fras_log.export.facts import Instrument

FloatArray = NDArray[np.float64]

SIDES: Final = 12
SHAFT_RADIUS_M: Final = 0.0035
HINGE_RADIUS_M: Final = 0.0028
BLADE_RADIUS_M: Final = 0.0012
BLADE_END_M: Final = 0.0004
# What is drawn of the shaft: the whole of it hides the tissue from most sides.
SHAFT_LENGTH_M: Final = 0.12
DASH_M: Final = 0.003


@dataclass(frozen=True, eq=False)
class Mesh:
    """Vertices [m] and faces wound outwards.

    Attributes
    ----------
    vertices_m : ndarray, shape (n, 3), float32
    faces : ndarray, shape (m, 3), uint32
    """

    vertices_m: NDArray[np.float32]
    faces: NDArray[np.uint32]


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Make one mesh of several."""
    starts = np.cumsum([0, *(len(one.vertices_m) for one in meshes[:-1])])
    faces = [one.faces + start for one, start in zip(meshes, starts.tolist(), strict=True)]
    return Mesh(
        np.concatenate([one.vertices_m for one in meshes]),
        np.concatenate(faces).astype(np.uint32),
    )


def cone(
    begin_m: Sequence[float],
    end_m: Sequence[float],
    begin_radius_m: float,
    end_radius_m: float,
) -> Mesh:
    """Return a closed frustum between two points; as many vertices wherever they lie."""
    begin, end = np.asarray(begin_m, dtype=np.float64), np.asarray(end_m, dtype=np.float64)
    along = end - begin
    length = float(np.linalg.norm(along))
    axis = along / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    side = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)
    angles = 2.0 * np.pi * np.arange(SIDES) / SIDES
    circle = np.outer(np.cos(angles), side) + np.outer(np.sin(angles), other)
    vertices = np.concatenate(
        [begin + begin_radius_m * circle, end + end_radius_m * circle, [begin], [end]]
    )
    here = np.arange(SIDES)
    there = (here + 1) % SIDES
    first, last = np.full(SIDES, 2 * SIDES), np.full(SIDES, 2 * SIDES + 1)
    faces = np.concatenate(
        [
            np.stack([here, there, here + SIDES], axis=-1),
            np.stack([there, there + SIDES, here + SIDES], axis=-1),
            np.stack([first, there, here], axis=-1),
            np.stack([last, here + SIDES, there + SIDES], axis=-1),
        ]
    )
    return Mesh(vertices.astype(np.float32), faces.astype(np.uint32))


def instrument_mesh(drawn: Instrument) -> Mesh:
    """Return shaft, wrist and both blades at their true pose."""
    wrist, centre = np.array(drawn.wrist_m), np.array(drawn.remote_centre_m)
    away = centre - wrist
    far = wrist + away * min(1.0, SHAFT_LENGTH_M / max(float(np.linalg.norm(away)), 1e-9))
    blades = [cone(drawn.hinge_m, end, BLADE_RADIUS_M, BLADE_END_M) for end in drawn.blades_m]
    return joined(
        [
            cone(far.tolist(), drawn.wrist_m, SHAFT_RADIUS_M, SHAFT_RADIUS_M),
            cone(drawn.wrist_m, drawn.hinge_m, HINGE_RADIUS_M, BLADE_RADIUS_M),
            *blades,
        ]
    )


def ring(centre_m: Sequence[float], radius_m: float, tube_m: float, count: int = 48) -> Mesh:
    """Return a flat torus about the vertical."""
    around = 2.0 * np.pi * np.arange(count) / count
    tube = 2.0 * np.pi * np.arange(SIDES) / SIDES
    radial = radius_m + tube_m * np.cos(tube)[None, :]
    vertices = np.stack(
        [
            radial * np.cos(around)[:, None],
            radial * np.sin(around)[:, None],
            np.broadcast_to(tube_m * np.sin(tube), (count, SIDES)),
        ],
        axis=-1,
    ).reshape(-1, 3) + np.asarray(centre_m)
    i, j = np.meshgrid(np.arange(count), np.arange(SIDES), indexing="ij")
    here, over = i * SIDES + j, ((i + 1) % count) * SIDES + j
    up, across = i * SIDES + (j + 1) % SIDES, ((i + 1) % count) * SIDES + (j + 1) % SIDES
    faces = np.concatenate(
        [
            np.stack([here, over, across], axis=-1).reshape(-1, 3),
            np.stack([here, across, up], axis=-1).reshape(-1, 3),
        ]
    )
    return Mesh(vertices.astype(np.float32), faces.astype(np.uint32))


def ball(radius_m: float) -> Mesh:
    """Return a sphere about the origin, as a stack of frusta."""
    heights = np.linspace(0.0, np.pi, SIDES // 2 + 1)
    around = 2.0 * np.pi * np.arange(SIDES) / SIDES
    rings = np.sin(heights)[:, None]
    vertices = radius_m * np.stack(
        [
            rings * np.cos(around),
            rings * np.sin(around),
            np.broadcast_to(np.cos(heights)[:, None], (len(heights), SIDES)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(len(heights) - 1), np.arange(SIDES), indexing="ij")
    here, right = i * SIDES + j, i * SIDES + (j + 1) % SIDES
    faces = np.concatenate(
        [
            np.stack([here, here + SIDES, right + SIDES], axis=-1).reshape(-1, 3),
            np.stack([here, right + SIDES, right], axis=-1).reshape(-1, 3),
        ]
    )
    return Mesh(vertices.astype(np.float32), faces.astype(np.uint32))


def dashes(begin_m: Sequence[float], end_m: Sequence[float]) -> FloatArray:
    """Return the dashes of a line, shape (n, 2, 3) [m]; none where it has no length."""
    begin, end = np.asarray(begin_m, dtype=np.float64), np.asarray(end_m, dtype=np.float64)
    length = float(np.linalg.norm(end - begin))
    count = int(np.ceil(length / (2.0 * DASH_M)))
    if count == 0:
        return np.zeros((0, 2, 3))
    starts = np.arange(count) * 2.0 * DASH_M
    ends = np.minimum(starts + DASH_M, length)
    direction = (end - begin) / length
    return np.stack(
        [begin + starts[:, None] * direction, begin + ends[:, None] * direction], axis=1
    )
