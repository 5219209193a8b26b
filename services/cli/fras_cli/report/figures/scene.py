"""What stands in a picture of the tissue, as triangles with colours in the world frame."""

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.colors import Normalize, to_rgb

from fras_cli.report.figures.camera import Camera, FloatArray, facing
from fras_cli.report.figures.style import force_colours
from fras_common.messages import Pose, TissueModel, TissueState
from fras_log import colours as palette
from fras_log.anchors import bind, normals

ROI_RADIUS_M = 0.003
ROI_COLOUR = palette.ROI
TOOL_COLOUR = palette.TOOL
TOOL_RADIUS_M = 0.0014
TOOL_LENGTH_M = 0.03
DOT_COLOUR = palette.ATTACHMENT
DOT_RADIUS_M = 0.00055
# A dot lies on a triangle whose middle may be nearer to the camera than the dot.
DOT_NEARER_M = 0.004
# More triangles than this need no subdivision to look smooth.
FINE_ENOUGH = 6000
_SUN = np.array([-0.25, -0.45, 0.86])
_AMBIENT = 0.6


@dataclass(frozen=True)
class Paint:
    """Triangles to paint.

    Parameters
    ----------
    triangles_m : ndarray, shape (n, 3, 3) [m]
    colours : ndarray, shape (n, 3)
        RGB.
    nearer_m : float
        Painted as if so much nearer to the camera.
    """

    triangles_m: FloatArray
    colours: FloatArray
    nearer_m: float = 0.0


def tissue_paint(
    camera: Camera, model: TissueModel, state: TissueState, force_norm: Normalize
) -> Paint:
    """Return the tissue's surface, coloured by the nodal force and lit from above."""
    surface = model.surface.ints()
    nodes_m, force_n = state.nodes_m.floats(), nodal_force(state)
    triangles_m = nodes_m[surface]
    shown = facing(camera, triangles_m)
    triangles_m, corner_n = triangles_m[shown], force_n[surface[shown]]
    if len(triangles_m) < FINE_ENOUGH:
        triangles_m, corner_n = _quartered(triangles_m, corner_n)
    colours = force_colours(force_norm, corner_n.mean(axis=1))
    return Paint(triangles_m, _lit(colours, normals(triangles_m)))


def attachment_paint(camera: Camera, model: TissueModel, state: TissueState) -> Paint:
    """Return dots on the top of the tissue over its attachment points, which lie under it."""
    places, upward = carried(model, state, model.fixed_points_m.floats())
    shown = upward @ camera.axes[2] > 0.15
    places, upward = places[shown] + 2e-4 * upward[shown], upward[shown]
    sideways = np.cross(upward, np.array([0.0, 1.0, 0.0]))
    sideways /= np.linalg.norm(sideways, axis=1, keepdims=True)
    forwards = np.cross(upward, sideways)
    angles = np.linspace(0.0, 2.0 * math.pi, 7)
    rim = (
        places[:, None]
        + DOT_RADIUS_M * np.cos(angles)[:, None] * sideways[:, None]
        + DOT_RADIUS_M * np.sin(angles)[:, None] * forwards[:, None]
    )
    centres = np.broadcast_to(places[:, None], rim[:, 1:].shape)
    triangles_m = np.stack([centres, rim[:, :-1], rim[:, 1:]], axis=2).reshape(-1, 3, 3)
    return Paint(triangles_m, _plain(DOT_COLOUR, len(triangles_m)), DOT_NEARER_M)


def roi_paint(model: TissueModel) -> Paint:
    """Return a small ball at the region of interest."""
    triangles_m = np.asarray(model.roi_m) + ROI_RADIUS_M * _ball()
    colours = _plain(ROI_COLOUR, len(triangles_m))
    return Paint(triangles_m, _lit(colours, normals(triangles_m)))


def tool_paint(camera: Camera, tip_in_world: Pose) -> Paint:
    """Return the end of an instrument as a strip that faces the camera, shaded as a cylinder."""
    tip = np.asarray(tip_in_world.position_m, dtype=np.float64)
    shaft = -approach(tip_in_world)
    across = np.cross(shaft, camera.axes[2])
    side = across / max(float(np.linalg.norm(across)), 1e-12)
    lengthwise = tip + np.linspace(0.0, TOOL_LENGTH_M, 13)[:, None] * shaft
    # The tip is pointed, so that one sees where it is.
    radii: FloatArray = np.linspace(0.0, 6 * TOOL_RADIUS_M, 13).clip(max=TOOL_RADIUS_M)[:, None]
    lanes: FloatArray = np.linspace(-1.0, 1.0, 7)
    grid: FloatArray = lengthwise[:, None] + np.multiply.outer(radii * lanes, side)
    triangles_m = _halves(grid)
    middle: FloatArray = (lanes[:-1] + lanes[1:]) / 2.0
    shade = 0.55 + 0.75 * np.sqrt(1.0 - middle * middle)
    shades = np.repeat(np.tile(shade, len(grid) - 1), 2)[:, None]
    colours = np.clip(_plain(TOOL_COLOUR, len(triangles_m)) * shades, 0.0, 1.0)
    return Paint(triangles_m, colours, TOOL_RADIUS_M)


def approach(tip_in_world: Pose) -> FloatArray:
    """Return the unit vector along the instrument, out of its tip (the tip frame's z axis)."""
    x, y, z, w = tip_in_world.quaternion_xyzw
    return np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])


def nodal_force(state: TissueState) -> FloatArray:
    """Magnitude of the elastic force of each node, shape (n_nodes,) [N]."""
    return np.linalg.norm(state.nodal_force_n.floats(), axis=1)


def carried(
    model: TissueModel, state: TissueState, points_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Carry points along with the tissue's upper face.

    Parameters
    ----------
    points_m : ndarray, shape (n, 3) [m]
        At rest; the highest place of the surface above or below each is meant.

    Returns
    -------
    places_m : ndarray, shape (m, 3) [m]
        Where the deformed upper face has them; points beside the tissue are left out.
    upward : ndarray, shape (m, 3)
        Its outward normal there.
    """
    anchors = bind(model.nodes_m.floats(), model.surface.ints(), points_m)
    now_m = state.nodes_m.floats()
    return anchors.places(now_m), anchors.upward(now_m)


def roi_points(model: TissueModel) -> FloatArray:
    """Points on the upper half of the ball at the region of interest, shape (n, 3) [m]."""
    points = _ball().reshape(-1, 3)
    return np.asarray(model.roi_m) + ROI_RADIUS_M * points[points[:, 2] >= 0.0]


def _quartered(triangles: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cut each triangle, shape (n, 3, 3), with values (n, 3), into four."""

    def cut(corners: FloatArray) -> FloatArray:
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        return np.concatenate([np.stack(part, axis=1) for part in parts])

    return cut(triangles), cut(values)


def _ball() -> FloatArray:
    """Triangles of a unit ball, wound outwards, shape (n, 3, 3)."""
    around, up = np.linspace(0.0, 2.0 * math.pi, 17), np.linspace(-math.pi / 2, math.pi / 2, 9)
    longitude, latitude = np.meshgrid(around, up)
    grid = np.stack(
        [
            np.cos(latitude) * np.cos(longitude),
            np.cos(latitude) * np.sin(longitude),
            np.sin(latitude),
        ],
        axis=-1,
    )
    return _halves(grid)


def _halves(grid: FloatArray) -> FloatArray:
    """Cut each cell of a grid of points, shape (n, m, 3), into two triangles, row by row."""
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    return np.stack([a, b, c, a, c, d], axis=2).reshape(-1, 3, 3)


def _lit(colours: FloatArray, outward: FloatArray) -> FloatArray:
    sun = _SUN / np.linalg.norm(_SUN)
    light = _AMBIENT + (1.0 - _AMBIENT) * np.clip(outward @ sun, 0.0, 1.0)
    return np.clip(colours * light[:, None], 0.0, 1.0)


def _plain(colour: str, count: int) -> FloatArray:
    return np.tile(np.array(to_rgb(colour)), (count, 1))
