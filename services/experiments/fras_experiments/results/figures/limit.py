"""Survival of the limit: the share of pulls that are not yet above it, against height."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fras_cli.report.figures.style import FAINT, drawing, open_frame
from fras_experiments.results.figures.style import MANY, WIDTH_IN
from fras_experiments.results.limits import PullEnd, pull_ends
from fras_experiments.results.pulls import Endurance
from fras_experiments.results.reading import Results
from fras_experiments.results.statistics import Survival, survival

HEIGHT_IN: Final = 3.2
COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")
STYLES: Final = ("-", "--", "-.", ":")


def survivals(results: Results) -> dict[str, tuple[Survival, Endurance]]:
    """Estimate the curve for first pulls, and for those after a re-plan.

    First pulls are split by `planner.ignore_ap` where it is swept, as they differ by the choice of
    their grasp.
    """
    ignoring = results.settings("planner.ignore_ap", "false") == "true"
    split = bool(np.unique(ignoring).size > 1)
    found = dict[str, list[PullEnd]]()
    for end in pull_ends(results):
        label = "pulls after a re-plan" if end.pull.number else "first pulls"
        if split and not end.pull.number:
            label += ", attachments " + ("ignored" if ignoring[end.row] else "heeded")
        found.setdefault(label, []).append(end)
    return {label: _estimated(ends) for label, ends in sorted(found.items())}


def _estimated(ends: Sequence[PullEnd]) -> tuple[Survival, Endurance]:
    heights = np.array([end.height_m for end in ends], dtype=np.float64)
    crossed = np.array([end.crossed for end in ends], dtype=np.bool_)
    return survival(heights, crossed), Endurance(heights, crossed)


def draw_limit(results: Results, seed: int) -> Figure | None:
    """Draw the curves; None where the campaign kept no series or has no limit."""
    del seed
    curves = survivals(results)
    if not curves:
        return None
    with drawing():
        figure = Figure(figsize=(0.72 * WIDTH_IN, HEIGHT_IN), layout="constrained")
        axes = figure.subplots()
        looks = zip(COLOURS, STYLES, strict=True)
        for (label, (curve, ends)), (colour, style) in zip(curves.items(), looks, strict=False):
            height_mm, share, low, high = _steps(curve)
            told = f"{label}: {curve.events} of {curve.n} crossed"
            axes.step(
                height_mm,
                share,
                where="post",
                color=colour,
                linestyle=style,
                linewidth=1.6,
                label=told,
            )
            axes.fill_between(
                height_mm, low, high, step="post", color=colour, alpha=0.15, linewidth=0
            )
            below = ends.height_m[~ends.crossed]
            axes.plot(
                1e3 * below, [100.0 * curve.at_value(height) for height in below],
                linestyle="", marker="|", ms=6, color=colour,
                rasterized=below.size > MANY,
            )  # fmt: skip
        axes.set_xlim(left=0.0)
        axes.set_ylim(0.0, 103.0)
        axes.set_xlabel("height of the tip [mm]")
        axes.set_ylabel("pulls not yet above the limit [%]")
        axes.grid(color=FAINT, alpha=0.25, linewidth=0.5)
        axes.legend(loc="lower left", fontsize=7.5)
        open_frame(axes)
    return figure


def _steps(curve: Survival) -> tuple[NDArray[np.float64], ...]:
    """Height [mm] and shares [%], begun at height 0 with all."""
    return (
        np.concatenate([[0.0], 1e3 * curve.at]),
        *(100.0 * np.concatenate([[1.0], one]) for one in (curve.share, curve.low, curve.high)),
    )
