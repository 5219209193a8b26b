"""Force against height while pulling, a panel for each scenario kind."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

from collections.abc import Sequence
from typing import Final, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fras_cli.report.figures.style import FAINT, INK, LIMIT, drawing, open_frame
from fras_experiments.results.figures.style import KIND_COLOURS, WIDTH_IN
from fras_experiments.results.limits import PullEnd, pull_ends
from fras_experiments.results.pulls import on_grid
from fras_experiments.results.reading import Results
from fras_experiments.results.trials import KINDS

HEIGHT_IN: Final = 3.0
STEP_M: Final = 0.001
# A median of fewer says nothing of the others.
SHARE_SHOWN: Final = 0.5


def draw_force(results: Results, seed: int) -> Figure | None:
    """Draw all pulls; None where the campaign kept no series."""
    del seed
    kinds, limits = results.trials.kind, np.unique(results.trials.soft_limit_n)
    ends = pull_ends(results)
    by_kind = {kind: [end for end in ends if kinds[end.row] == kind] for kind in KINDS}
    by_kind = {kind: mine for kind, mine in by_kind.items() if mine}
    if not by_kind:
        return None
    with drawing():
        figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), layout="constrained")
        panels = figure.subplots(1, len(by_kind), sharex=True, sharey=True, squeeze=False)[0]
        for axes, (kind, mine) in zip(panels, by_kind.items(), strict=True):
            later = [end for end in mine if end.pull.number]
            first = [end for end in mine if not end.pull.number]
            _draw(axes, first, KIND_COLOURS[kind], "-", INK if later else FAINT)
            _draw(axes, later, KIND_COLOURS[kind], "--", FAINT)
            axes.set_title(f"{kind}: {_counted(first, later)}", fontsize=8.5)
            axes.set_xlabel("height of the tip [mm]")
            if limits.size == 1:
                _limit(axes, float(limits[0]), "limit" if results.stopped.all() else "limit (off)")
            open_frame(axes)
        panels[0].set_ylabel("force [N]")
        panels[0].set_ylim(bottom=0.0)
        panels[0].set_xlim(left=0.0)
    return figure


def _counted(first: Sequence[PullEnd], later: Sequence[PullEnd]) -> str:
    return f"first pulls {len(first)}" + (f", later (- -) {len(later)}" if later else "")


def _limit(axes: Axes, limit_n: float, label: str) -> None:
    axes.axhline(limit_n, color=LIMIT, linestyle="--", linewidth=1.1)
    axes.annotate(
        label, (0.02, limit_n), xycoords=("axes fraction", "data"), xytext=(0, 2),
        textcoords="offset points", fontsize=7, color=LIMIT,
    )  # fmt: skip


def _draw(
    axes: Axes, ends: Sequence[PullEnd], colour: str, style: Literal["-", "--"], faint: str
) -> None:
    if not ends:
        return
    axes.add_collection(
        LineCollection(
            [np.column_stack([1e3 * end.pull.height_m, end.pull.force_n]) for end in ends],
            colors=faint,
            linestyles=[style if style == "-" else (0, (3, 2))],
            linewidths=0.5,
            alpha=0.4,
            # Hundreds of curves are pixels also in a vector format.
            rasterized=True,
        )
    )
    height_m, low, middle, high = bands(ends)
    axes.fill_between(1e3 * height_m, low, high, color=colour, alpha=0.25, linewidth=0)
    axes.plot(1e3 * height_m, middle, color=colour, linewidth=2.2, linestyle=style)
    axes.autoscale_view()


Curve = NDArray[np.float64]


def bands(ends: Sequence[PullEnd]) -> tuple[Curve, Curve, Curve, Curve]:
    """Quarters and median of the force over a grid of heights.

    A pull that was stopped as it crossed its limit counts as at the limit higher up: it bears no
    less there. Without it the median would sink as the steep ones leave.

    Returns
    -------
    height_m, low, middle, high : ndarray, shape (n_heights,)
        NaN where fewer than half of the pulls are known, and a median that is at the limit.
    """
    top_m = max(float(end.pull.height_m.max()) for end in ends)
    height_m = np.arange(0.0, top_m + STEP_M / 2, STEP_M)
    force_n = on_grid([end.pull for end in ends], height_m)
    for row, end in enumerate(ends):
        if end.stopped and end.crossed:
            force_n[row, height_m > end.pull.height_m.max()] = end.limit_n
    shown = (~np.isnan(force_n)).mean(axis=0) >= SHARE_SHOWN
    low, middle, high = np.full((3, height_m.size), np.nan)
    quarters = np.nanquantile(force_n[:, shown], [0.25, 0.5, 0.75], axis=0)
    low[shown], middle[shown], high[shown] = quarters
    if all(end.stopped for end in ends):
        middle[middle >= min(end.limit_n for end in ends)] = np.nan
    return height_m, low, middle, high
