"""The tissue before and after in 3D: its surface coloured by force, and what surrounds it."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize, PowerNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Polygon

from fras_cli.report.figures import scene
from fras_cli.report.figures.camera import Camera, FloatArray, best_camera
from fras_cli.report.figures.style import FAINT, FORCE_MAP, INK, LIMIT, drawing
from fras_cli.report.trial import Trial
from fras_common.messages import Pose, TissueModel, TissueState

# A picture of the highest lift is worth its place when the tissue ends this much lower.
WORTH_M = 0.005
BED_MARGIN_M = 0.01
AXIS_M = 0.02


@dataclass(frozen=True)
class View:
    """One state to show, under its title."""

    title: str
    state: TissueState
    tips: dict[str, Pose]


@dataclass(frozen=True)
class Stage:
    """What all views of one figure share."""

    trial: Trial
    model: TissueModel
    views: list[View]
    camera: Camera
    force_norm: Normalize


def make_stage(trial: Trial, highest: bool = True) -> Stage | None:
    """Choose views, camera and scale of force.

    Parameters
    ----------
    trial : Trial
    highest : bool
        Whether the highest lift may be shown beside before and after.

    Returns
    -------
    Stage or None
        None where the log holds no tissue.
    """
    if trial.views is None or trial.model is None:
        return None
    views = _views(trial, highest)
    surface = trial.model.surface.ints()
    lifted = [view.state.nodes_m.floats()[surface] for view in views[1:]]
    camera = best_camera(scene.roi_points(trial.model), lifted)
    peak_n = max(float(scene.nodal_force(view.state).max(initial=0.0)) for view in views)
    # Few nodes bear much; the root keeps what the many bear apart from nothing.
    top_n = 1.1 * max(peak_n, trial.scenario.awareness.force_limit_n)
    norm = PowerNorm(0.5, 0.0, top_n)
    return Stage(trial, trial.model, views, camera, norm)


def tissue_figure(stage: Stage) -> Figure:
    """All views side by side on one scale, with the colour bar."""
    with drawing():
        height_in = 4.2 if len(stage.views) < 3 else 3.4
        figure = Figure(figsize=(8.4, height_in), layout="constrained")
        draw_views(figure, stage)
    return figure


def draw_views(figure: Figure | SubFigure, stage: Stage) -> None:
    """Draw the stage's views side by side, and one colour bar under them."""
    panels: list[Axes] = list(figure.subplots(1, len(stage.views), squeeze=False)[0])
    low, high = _bounds(stage)
    for axes, view in zip(panels, stage.views, strict=True):
        _draw_view(axes, stage, view)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
    _draw_axes(panels[0], stage.camera, low)
    bar = figure.colorbar(
        ScalarMappable(stage.force_norm, FORCE_MAP),
        ax=panels,
        location="bottom",
        shrink=0.5,
        pad=0.01,
        aspect=36,
        label="nodal force [N]",
    )
    bar.ax.axvline(stage.trial.scenario.awareness.force_limit_n, color=LIMIT, lw=1.6)


def _views(trial: Trial, highest: bool) -> list[View]:
    if trial.views is None:
        return []
    views = trial.views
    chosen = [("before", views.first)]
    if highest and _top_m(views.highest) - _top_m(views.last) > WORTH_M:
        chosen.append(("highest lift", views.highest))
    if views.last.tick > views.first.tick:
        chosen.append(("after", views.last))
    shown: list[View] = []
    for name, state in chosen:
        robot = trial.robot_at(state.tick)
        title = f"{name} (t = {state.tick * trial.dt_s:.1f} s)"
        shown.append(View(title, state, dict(robot.tips_in_world) if robot else {}))
    return shown


def _top_m(state: TissueState) -> float:
    return float(state.nodes_m.floats()[:, 2].max())


def _draw_view(axes: Axes, stage: Stage, view: View) -> None:
    camera, model = stage.camera, stage.model
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(view.title, loc="center")
    bed = camera.project(_bed(model))[:, :2]
    axes.add_patch(Polygon(bed, facecolor="#eef1f4", edgecolor="#c9d1d9", lw=0.6, zorder=1))
    paints = [
        scene.tissue_paint(camera, model, view.state, stage.force_norm),
        scene.attachment_paint(camera, model, view.state),
        scene.roi_paint(model),
        *(scene.tool_paint(camera, tip) for tip in view.tips.values()),
    ]
    flat = np.concatenate([camera.project(paint.triangles_m) for paint in paints])
    colours = np.concatenate([paint.colours for paint in paints])
    nearer = np.concatenate([np.full(len(p.triangles_m), p.nearer_m) for p in paints])
    order = np.argsort(flat[..., 2].mean(axis=1) + nearer, kind="stable")
    surface = PolyCollection(
        list(flat[order][..., :2]), facecolors=colours[order], edgecolors=colours[order], lw=0.6
    )
    # Thousands of triangles: as pixels within the figure, whose words and lines stay vectors.
    surface.set_rasterized(True)
    surface.set_zorder(2)
    axes.add_collection(surface, autolim=False)
    _mark_roi(axes, stage)
    for name, tip in view.tips.items():
        end = np.asarray(tip.position_m) - scene.TOOL_LENGTH_M * scene.approach(tip)
        right, up = camera.project(end)[:2]
        axes.annotate(
            name.upper(),
            (right, up),
            xytext=(0, 2),
            textcoords="offset points",
            ha="center",
            fontsize=7,
            color=scene.TOOL_COLOUR,
        )


def _mark_roi(axes: Axes, stage: Stage) -> None:
    """Ring the region of interest, seen or hidden: what must be clear of tissue around it."""
    radius_m = stage.trial.scenario.awareness.visible_distance_m
    angles = np.linspace(0.0, 2.0 * math.pi, 73)
    roi = np.asarray(stage.model.roi_m)
    ring = roi + radius_m * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(73)])
    flat = stage.camera.project(ring)
    axes.plot(flat[:, 0], flat[:, 1], color=scene.ROI_COLOUR, lw=1.1, ls=(0, (3, 1.5)), zorder=4)
    lowest = flat[np.argmin(flat[:, 1])]
    axes.annotate(
        "ROI",
        (lowest[0], lowest[1]),
        xytext=(0, -2),
        textcoords="offset points",
        ha="center",
        va="top",
        color=scene.ROI_COLOUR,
        fontsize=7.5,
        fontweight="bold",
        zorder=5,
    )


def _bed(model: TissueModel) -> FloatArray:
    nodes = model.nodes_m.floats()
    (x0, y0, z0), (x1, y1, _) = nodes.min(axis=0), nodes.max(axis=0)
    m = BED_MARGIN_M
    return np.array(
        [[x0 - m, y0 - m, z0], [x1 + m, y0 - m, z0], [x1 + m, y1 + m, z0], [x0 - m, y1 + m, z0]]
    )


def _bounds(stage: Stage) -> tuple[FloatArray, FloatArray]:
    """Lower left and upper right corner that hold every view [m]."""
    points = [_bed(stage.model)]
    for view in stage.views:
        points.append(view.state.nodes_m.floats())
        for tip in view.tips.values():
            position = np.asarray(tip.position_m)
            points += [position[None], (position - scene.TOOL_LENGTH_M * scene.approach(tip))[None]]
    flat = stage.camera.project(np.concatenate(points))[:, :2]
    margin = 0.03 * np.ptp(flat, axis=0)
    return flat.min(axis=0) - margin, flat.max(axis=0) + 2 * margin


def _draw_axes(axes: Axes, camera: Camera, corner: FloatArray) -> None:
    """Draw the world's axes, each 20 mm long: the scale in every direction."""
    arms = camera.project(AXIS_M * np.eye(3))[:, :2]
    origin = corner - np.minimum(arms.min(axis=0), 0.0) + 0.004
    for name, arm in zip("xyz", arms, strict=True):
        end = origin + arm
        axes.plot([origin[0], end[0]], [origin[1], end[1]], color=INK, lw=1.0, zorder=6)
        label = origin + 1.25 * arm
        axes.text(label[0], label[1], name, ha="center", va="center", fontsize=7, zorder=6)
    axes.annotate(
        f"{1e3 * AXIS_M:.0f} mm each",
        (origin[0], corner[1]),
        xytext=(0, -6),
        textcoords="offset points",
        ha="left",
        fontsize=6.5,
        color=FAINT,
    )
