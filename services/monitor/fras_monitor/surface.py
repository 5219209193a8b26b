"""The tissue's faces sorted into bands of one colour each: a mesh of the viewer has one colour."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fras_log.colours import FORCE_STOPS, force_rgb, rgb
from fras_monitor.commands import Colouring

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int32]
Rgb = tuple[int, int, int]

BANDS: Final = 10
PLAIN: Final[Rgb] = rgb(FORCE_STOPS[0])
# Cividis' ends and steps between: lightness rises evenly, blue to yellow, for any colour vision.
LIFT_STOPS: Final = ("#00224e", "#35456c", "#666970", "#948e77", "#c8b866", "#fee838")
LIFT_TOP_M: Final = 0.05


@dataclass(frozen=True, eq=False)
class Band:
    """Faces of one colour, with the nodes that they use and no others.

    Attributes
    ----------
    vertices_m : ndarray, shape (n, 3), float32 [m]
    faces : ndarray, shape (m, 3), uint32
    """

    colour: Rgb
    vertices_m: NDArray[np.float32]
    faces: NDArray[np.uint32]


def share_of(
    by: Colouring, nodes_m: FloatArray, rest_m: FloatArray, force_n: FloatArray, top_n: float
) -> FloatArray:
    """Say for each node where it lies on the scale, 0 to 1.

    Parameters
    ----------
    by : {"force", "lift", "plain"}
        `lift`: how far the node is from where it was at rest.
    nodes_m, rest_m : ndarray, shape (n, 3) [m]
    force_n : ndarray, shape (n,) [N]
        Magnitude.
    top_n : float
        Force at the scale's end.
    """
    match by:
        case "force":
            # Along the root, as `force_rgb` does: few nodes bear much.
            return np.sqrt(_within(force_n / top_n))
        case "lift":
            moved_m = np.linalg.norm(nodes_m - rest_m, axis=1)
            return _within(moved_m / LIFT_TOP_M)
        case "plain":
            return np.zeros(len(nodes_m))


def _within(share: FloatArray) -> FloatArray:
    """Bring a share to 0 to 1; what is no number is none."""
    return np.minimum(np.fmax(share, 0.0), 1.0)


@lru_cache
def band_colours(by: Colouring) -> tuple[Rgb, ...]:
    """Return the colour of each band, from the scale's start to its end."""
    if by == "plain":
        return (PLAIN,) * BANDS
    middles = (np.arange(BANDS) + 0.5) / BANDS
    if by == "force":
        rows = force_rgb(middles**2, 1.0)
    else:
        stops = np.array([rgb(one) for one in LIFT_STOPS], dtype=np.float64)
        places = np.linspace(0.0, 1.0, len(stops))
        rows = np.stack([np.interp(middles, places, stops[:, i]) for i in range(3)], axis=-1)
    return tuple((int(red), int(green), int(blue)) for red, green, blue in np.rint(rows).tolist())


def bands(nodes_m: FloatArray, surface: IndexArray, share: FloatArray, by: Colouring) -> list[Band]:
    """Sort the faces by the largest share among their nodes.

    Parameters
    ----------
    nodes_m : ndarray, shape (n, 3) [m]
    surface : ndarray of int, shape (m, 3)
        Faces, wound outwards.
    share : ndarray, shape (n,)
        From `share_of`.
    by : {"force", "lift", "plain"}

    Returns
    -------
    list of BANDS Band
        Empty bands among them, so that each keeps its place.
    """
    of_face = np.minimum((share[surface].max(axis=1) * BANDS).astype(np.int32), BANDS - 1)
    return [
        _compact(colour, nodes_m, surface[of_face == number])
        for number, colour in enumerate(band_colours(by))
    ]


def _compact(colour: Rgb, nodes_m: FloatArray, faces: IndexArray) -> Band:
    used = np.zeros(len(nodes_m), dtype=bool)
    used[faces] = True
    place = np.cumsum(used, dtype=np.int64) - 1
    return Band(
        colour, nodes_m[used].astype(np.float32), place[faces].astype(np.uint32).reshape(-1, 3)
    )
