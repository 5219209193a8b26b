"""Simple meshes of our own: instruments with jaws, rings, dashed paths. Metres, world frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
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
# Where on the shaft its name stands: above the tissue in most poses, and in sight.
NAME_M: Final = 0.03
INSTRUMENT_RADII_M: Final = np.array(
    [
        (SHAFT_RADIUS_M, SHAFT_RADIUS_M),
        (HINGE_RADIUS_M, BLADE_RADIUS_M),
        (BLADE_RADIUS_M, BLADE_END_M),
        (BLADE_RADIUS_M, BLADE_END_M),
    ]
)
UP: Final = np.array([0.0, 0.0, 1.0])
TURNS: Final = ([1, 2, 0], [2, 0, 1])
ANGLES_RAD: Final = 2.0 * np.pi * np.arange(SIDES) / SIDES
CIRCLE: Final = (np.cos(ANGLES_RAD)[:, None], np.sin(ANGLES_RAD)[:, None])


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


def cones(ends_m: FloatArray, radii_m: FloatArray) -> Mesh:
    """Return closed frusta as one mesh; as many vertices wherever they lie.

    Parameters
    ----------
    ends_m : ndarray, shape (n, 2, 3) [m]
    radii_m : ndarray, shape (n, 2) [m]
    """
    along = ends_m[:, 1] - ends_m[:, 0]
    length = np.sqrt((along * along).sum(axis=1))
    axis = np.where(length[:, None] > 0.0, along / np.maximum(length, 1e-30)[:, None], UP)
    side = _cross(axis, np.eye(3)[np.abs(axis).argmin(axis=1)])
    side /= np.sqrt((side * side).sum(axis=1))[:, None]
    circle = CIRCLE[0] * side[:, None, :] + CIRCLE[1] * _cross(axis, side)[:, None, :]
    rims = ends_m[:, :, None, :] + radii_m[:, :, None, None] * circle[:, None, :, :]
    vertices = np.concatenate([rims.reshape(len(ends_m), -1, 3), ends_m], axis=1)
    return Mesh(vertices.reshape(-1, 3).astype(np.float32), _cone_faces(len(ends_m)))


def _cross(one: FloatArray, two: FloatArray) -> FloatArray:
    """As `numpy.cross` for rows, without its many looks at shapes."""
    return one[:, TURNS[0]] * two[:, TURNS[1]] - one[:, TURNS[1]] * two[:, TURNS[0]]


@cache
def _cone_faces(count: int) -> NDArray[np.uint32]:
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
    starts = (2 * SIDES + 2) * np.arange(count)
    return (faces + starts[:, None, None]).reshape(-1, 3).astype(np.uint32)


def instrument_mesh(drawn: Instrument) -> Mesh:
    """Return shaft, wrist and both blades at their true pose."""
    wrist, centre = np.array(drawn.wrist_m), np.array(drawn.remote_centre_m)
    away = centre - wrist
    far = wrist + away * min(1.0, SHAFT_LENGTH_M / max(float(np.linalg.norm(away)), 1e-9))
    ends = [
        (far, drawn.wrist_m),
        (drawn.wrist_m, drawn.hinge_m),
        *((drawn.hinge_m, end) for end in drawn.blades_m),
    ]
    return cones(np.array(ends), INSTRUMENT_RADII_M)


def name_place_m(drawn: Instrument) -> tuple[float, float, float]:
    """Where on the shaft an instrument's name stands [m]."""
    wrist, centre = np.array(drawn.wrist_m), np.array(drawn.remote_centre_m)
    away = centre - wrist
    x, y, z = wrist + away * min(1.0, NAME_M / max(float(np.linalg.norm(away)), 1e-9))
    return float(x), float(y), float(z)


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
