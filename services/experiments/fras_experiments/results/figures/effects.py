"""What each point of a sweep changes against the first: which assumption moves the result."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fras_cli.report.figures.style import FAINT, INK, drawing, open_frame
from fras_experiments.results.effects import sweep_effects
from fras_experiments.results.figures.style import WIDTH_IN
from fras_experiments.results.reading import Results
from fras_experiments.results.statistics import Interval

ROW_IN: Final = 0.21
FRAME_IN: Final = 0.95
MOVED: Final = "#d55e00"
SAME: Final = "#666666"


def draw_effects(results: Results, seed: int) -> Figure | None:
    """Draw mean changes with their intervals, a row a point; None without a sweep."""
    base, effects = sweep_effects(results.trials, seed)
    if not effects:
        return None
    with drawing():
        height_in = FRAME_IN + ROW_IN * len(effects)
        figure = Figure(figsize=(WIDTH_IN, height_in), layout="constrained")
        left, middle, right = figure.subplots(1, 3, sharey=True)
        _draw(left, [(one.visibility.mean_difference, one.visibility.mean_ci) for one in effects])
        left.set_xlabel("visibility [points]")
        _draw(middle, [(one.force.mean_difference, one.force.mean_ci) for one in effects])
        middle.set_xlabel("largest force [N]")
        _draw(
            right,
            [
                (
                    100.0 * one.crossed.difference,
                    Interval(100.0 * one.crossed.ci.low, 100.0 * one.crossed.ci.high),
                )
                for one in effects
            ],
        )
        right.set_xlabel("reached the limit [points]")
        labels = [one.label.replace(", ", "\n") for one in effects]
        left.set_yticks(range(len(effects)), labels, fontsize=7)
        left.invert_yaxis()
        figure.suptitle(f"change against {base}", fontsize=8.5)
    return figure


def _draw(axes: Axes, changes: Sequence[tuple[float, Interval]]) -> None:
    axes.axvline(0.0, color=INK, linewidth=0.8)
    for row, (mean, ci) in enumerate(changes):
        known = not (np.isnan(ci.low) or np.isnan(ci.high))
        moved = known and not ci.low <= 0.0 <= ci.high
        axes.errorbar(
            [mean], [row],
            xerr=[[max(0.0, mean - ci.low)], [max(0.0, ci.high - mean)]] if known else None,
            fmt="o" if moved else "x", ms=4, color=MOVED if moved else SAME, capsize=2,
            elinewidth=1.0,
        )  # fmt: skip
    axes.margins(y=0.5 / len(changes))
    axes.grid(axis="x", color=FAINT, alpha=0.25, linewidth=0.5)
    open_frame(axes)
