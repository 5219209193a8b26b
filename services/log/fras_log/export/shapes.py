"""Sizes, colours and shapes that the viewers share, the scale of the forces' colours too."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fras_log.colours import LIMIT, ColourArray, force_rgb, rgb
from fras_log.export.facts import BlockKind, FloatArray, Stage

GAP_M: Final = 0.012
WIDTH_M: Final = 0.006
CELLS: Final = 48
# Where the viewers stand at first, as the report's camera likes to.
EYE_M: Final = (0.165, -0.085, 0.12)
LOOK_AT_M: Final = (0.055, 0.055, 0.015)
# Path in a Rerun recording, colour on its dark and its light ground, name.
SERIES: Final = (
    ("/force/measured", "#56b4e9", "force"),
    ("/force/limit", "#d55e00", "limit"),
    ("/force/hard_limit", "#cc79a7", "hard limit"),
    ("/visibility/measured", "#56b4e9", "visible"),
    ("/visibility/threshold", "#8b949e", "threshold"),
    ("/time/tick_ms", "#8b949e", "tick to tick"),
    ("/time/solve_ms", "#009e73", "finite elements"),
)
ROI_RADIUS_M: Final = 0.003
ATTACHMENT_RADIUS_M: Final = 0.0008
ABOVE_RADIUS_M: Final = 0.0012
RING_RADIUS_M: Final = 0.00025
ABOVE_M: Final = np.array([0.0, 0.0, 0.006])
TIP_AXES_M: Final = 0.008
SHAFT_RADIUS_M: Final = 0.0014
BLADE_RADIUS_M: Final = 0.0008
BLOCK_RADII_M: Final[dict[BlockKind, float]] = {
    "free": 0.0012,
    "fixed": 0.0012,
    "chosen": 0.0018,
    "held": 0.0018,
}
# Okabe and Ito's palette, as in the report: distinct under every common colour vision.
BLOCK_COLOURS: Final[dict[BlockKind, str]] = {
    "free": "#56b4e9",
    "fixed": "#3b4252",
    "chosen": "#e69f00",
    "held": "#009e73",
}


@dataclass(frozen=True, eq=False)
class Legend:
    """A strip from no force to the hard limit, with a mark across it at the soft one.

    Parameters
    ----------
    vertices_m : ndarray, shape (n, 3) [m]
    colours : ndarray, shape (n, 3), uint8
    triangles : ndarray of int, shape (m, 3)
    labels : tuple of (text, place [m])
    """

    vertices_m: FloatArray
    colours: ColourArray
    triangles: NDArray[np.int32]
    labels: tuple[tuple[str, FloatArray], ...]


def legend(stage: Stage) -> Legend:
    """Lay the scale along the tissue's edge of low y."""
    lower, upper = stage.rest_m.min(axis=0), stage.rest_m.max(axis=0)
    top_n = stage.hard_limit_n

    def place(force_n: float, across: float, above_m: float = 0.0) -> FloatArray:
        x = lower[0] + (upper[0] - lower[0]) * force_n / top_n
        return np.array([x, lower[1] - GAP_M - WIDTH_M * across, lower[2] + above_m])

    forces_n = np.linspace(0.0, top_n, CELLS + 1)
    vertices = [place(force_n, across) for force_n in forces_n.tolist() for across in (0.0, 1.0)]
    half_mark_n = top_n / 200.0
    mark = [
        place(stage.limit_n + side * half_mark_n, across, 2e-4)
        for side in (-1.0, 1.0)
        for across in (-0.4, 1.4)
    ]
    cells = 2 * np.arange(CELLS, dtype=np.int32)[:, None]
    halves = np.array([[0, 1, 2], [1, 3, 2]], dtype=np.int32)
    triangles = np.concatenate([cells + half for half in halves])
    of_mark = len(vertices) + halves
    colours = np.repeat(force_rgb(forces_n, top_n), 2, axis=0)
    return Legend(
        vertices_m=np.array([*vertices, *mark]),
        colours=np.concatenate([colours, np.tile(np.array(rgb(LIMIT), np.uint8), (4, 1))]),
        triangles=np.concatenate([triangles, of_mark]).astype(np.int32),
        labels=(
            ("0 N", place(0.0, 2.2)),
            (f"limit {stage.limit_n:.2f} N", place(stage.limit_n, 2.2)),
            (f"hard limit {top_n:.2f} N", place(top_n, 2.2)),
        ),
    )


def ring(stage: Stage) -> FloatArray:
    """Return the circle around the ROI that must be clear of tissue, shape (n, 3) [m]."""
    angles = np.linspace(0.0, 2.0 * np.pi, 73)
    flat = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=-1)
    return np.asarray(stage.roi_m) + stage.clear_m * flat
