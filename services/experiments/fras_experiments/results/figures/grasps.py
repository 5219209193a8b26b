"""Where grasps land: on the tissue, and as seen from the region of interest."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

from collections import Counter
from typing import Any, Final, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Rectangle
from numpy.typing import NDArray

from fras_cli.report.figures.style import FAINT, INK, drawing, open_frame
from fras_experiments.results.figures.style import (
    KIND_COLOURS,
    KIND_MARKS,
    MANY,
    WIDTH_IN,
    kind_name,
)
from fras_experiments.results.reading import Results
from fras_experiments.results.trials import KINDS, Trials

HEIGHT_IN: Final = 3.9
TISSUE_M: Final = (0.1, 0.12)
"""The default scenario's, and the paper's."""
CLOSE_MM: Final = 10.0
"""Tissue within it must move away for the region of interest to be seen (the paper's P_close)."""
AREA_ONE: Final = 14.0


def draw_grasps(results: Results, seed: int) -> Figure | None:
    """Draw both maps; None where nothing was grasped."""
    del seed
    trials = results.trials
    grasped = trials.where(~(np.isnan(trials.grasp_x_m) | np.isnan(trials.roi_x_m)))
    if not len(grasped):
        return None
    with drawing():
        figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), layout="constrained")
        left, right = figure.subplots(1, 2)
        size = _tissue_mm(results)
        _on_tissue(left, grasped, size)
        _from_roi(right, grasped)
        kinds = [kind for kind in KINDS if (grasped.kind == kind).any()]
        handles = [*(_handle(kind) for kind in kinds), *_others()]
        figure.legend(handles=handles, loc="outside lower center", ncols=8)
    return figure


def _tissue_mm(results: Results) -> tuple[float, float] | None:
    """Outline of the tissue; None for one from a mesh file, which is no rectangle."""
    if results.fixed("tissue.mesh_file") or "tissue.mesh_file" in results.trials.swept:
        return None
    size = results.fixed("tissue.size_m")
    if not isinstance(size, list):
        return (1e3 * TISSUE_M[0], 1e3 * TISSUE_M[1])
    width, depth = (1e3 * float(one) for one in cast("list[Any]", size)[:2])
    return width, depth


def _handle(kind: str) -> Line2D:
    return Line2D(
        [], [], linestyle="", marker=KIND_MARKS[kind], color=KIND_COLOURS[kind],
        markersize=6, label=f"{kind_name(kind)}",
    )  # fmt: skip


def _others() -> list[Line2D]:
    """Explain what is no grasp: the region of interest, and what must be lifted clear of it."""
    return [
        Line2D([], [], linestyle="", marker="+", color=INK, markersize=5, label="ROI"),
        Line2D(
            [], [], linestyle="--", color=INK, linewidth=0.8, label=f"{CLOSE_MM:.0f} mm around it"
        ),
    ]


def counted(x_mm: NDArray[np.float64], y_mm: NDArray[np.float64]) -> dict[tuple[float, float], int]:
    """How many points lie at each place, to a tenth of a millimetre."""
    return dict(Counter(zip(np.round(x_mm, 1).tolist(), np.round(y_mm, 1).tolist(), strict=True)))


def _on_tissue(axes: Axes, trials: Trials, size_mm: tuple[float, float] | None) -> None:
    if size_mm is not None:
        axes.add_patch(Rectangle((0.0, 0.0), *size_mm, fill=False, edgecolor=INK, linewidth=1.0))
        axes.set_xlim(-0.04 * size_mm[0], 1.04 * size_mm[0])
        axes.set_ylim(-0.04 * size_mm[1], 1.04 * size_mm[1])
    axes.scatter(
        1e3 * trials.roi_x_m, 1e3 * trials.roi_y_m, s=7, marker="+", color=INK, linewidths=0.6,
        zorder=2, rasterized=len(trials) > MANY,
    )  # fmt: skip
    # Kinds that share a block stand beside each other.
    kinds = [kind for kind in KINDS if (trials.kind == kind).any()]
    for place, kind in enumerate(kinds):
        mine = trials.where(trials.kind == kind)
        aside = 3.0 * (place - (len(kinds) - 1) / 2)
        for (x, y), count in counted(1e3 * mine.grasp_x_m, 1e3 * mine.grasp_y_m).items():
            axes.scatter(
                [x + aside], [y], s=AREA_ONE * count, marker=KIND_MARKS[kind],
                color=KIND_COLOURS[kind], edgecolors=INK, linewidths=0.4, alpha=0.85, zorder=3,
            )  # fmt: skip
    axes.set_aspect("equal")
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")
    axes.set_title("On the tissue")
    open_frame(axes)


def _from_roi(axes: Axes, trials: Trials) -> None:
    x_mm = 1e3 * (trials.grasp_x_m - trials.roi_x_m)
    y_mm = 1e3 * (trials.grasp_y_m - trials.roi_y_m)
    axes.axhline(0.0, color=FAINT, linewidth=0.5, zorder=0)
    axes.axvline(0.0, color=FAINT, linewidth=0.5, zorder=0)
    axes.add_patch(Circle((0.0, 0.0), CLOSE_MM, fill=False, edgecolor=INK, linestyle="--", lw=0.8))
    for kind in KINDS:
        mine = trials.kind == kind
        axes.scatter(
            x_mm[mine], y_mm[mine], s=AREA_ONE, marker=KIND_MARKS[kind], color=KIND_COLOURS[kind],
            edgecolors=INK, linewidths=0.3, alpha=0.8, zorder=3,
            rasterized=len(trials) > MANY,
        )  # fmt: skip
    reach = 1.08 * max(float(np.abs([x_mm, y_mm]).max()), CLOSE_MM)
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_aspect("equal")
    distance = np.median(np.hypot(x_mm, y_mm))
    axes.set_title(f"Seen from the ROI: median {distance:.0f} mm")
    axes.set_xlabel("grasp - ROI, x [mm]")
    axes.set_ylabel("grasp - ROI, y [mm]")
    open_frame(axes)
