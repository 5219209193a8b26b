"""What is seen against how often the limit is reached for it, a point of the sweep each."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fras_cli.report.figures.style import FAINT, drawing, open_frame
from fras_experiments.results.figures.style import WIDTH_IN
from fras_experiments.results.groups import Group, by_point
from fras_experiments.results.reading import Results
from fras_experiments.results.statistics import describe, share
from fras_experiments.results.trials import Trials

HEIGHT_IN: Final = 3.3
MOST: Final = 12
"""Points that can be told apart."""
FULL: Final = 0.98
"""Of the goal of visibility, docs/experiments.md."""
COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
MARKS: Final = ("o", "s", "^", "D", "v", "P")


def draw_tradeoff(results: Results, seed: int) -> Figure | None:
    """Draw a mark for each point of the sweep; None where there are none, or too many."""
    trials, points = results.trials, by_point(results.trials)
    if not 1 < len(points) <= MOST or trials.planned_only:
        return None
    field = _common_field(points)
    with drawing():
        figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), layout="constrained")
        left, right = figure.subplots(1, 2)
        for place, point in enumerate(points):
            label = point.label.removeprefix(f"{field} = ") if field else point.label
            _draw(left, right, trials.where(point.chosen), label, place, seed)
        left.set_xlabel("trials that reached the limit [%]")
        left.set_ylabel("visibility at the end, mean [%]")
        right.set_xlabel("largest force, mean [N]")
        right.set_ylabel(f"scenes below {100 * FULL:g} % [%]")
        right.set_ylim(bottom=0.0)
        for axes in (left, right):
            axes.grid(color=FAINT, alpha=0.25, linewidth=0.5)
            open_frame(axes)
        handles, labels = left.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper left", ncols=3, fontsize=7.5, title=field)
    return figure


def _draw(left: Axes, right: Axes, part: Trials, label: str, place: int, seed: int) -> None:
    counted = part.crossings[~np.isnan(part.crossings)]
    seen = part.visibility[~np.isnan(part.visibility)]
    reached = share(int((counted > 0).sum()), counted.size)
    below = share(int((seen < FULL).sum()), seen.size)
    visible = describe(100.0 * part.visibility, seed=seed)
    force = describe(part.max_force_n, seed=seed)
    look: dict[str, Any] = {
        "color": COLOURS[place % len(COLOURS)],
        "marker": MARKS[(place + place // len(COLOURS)) % len(MARKS)],
        "ms": 6,
        "elinewidth": 0.8,
        "capsize": 2,
        "linestyle": "none",
    }
    for axes, x, x_ends, y, y_ends in (
        (
            left,
            100.0 * reached.value,
            (100.0 * reached.ci.low, 100.0 * reached.ci.high),
            visible.mean,
            (visible.mean_ci.low, visible.mean_ci.high),
        ),
        (
            right,
            force.mean,
            (force.mean_ci.low, force.mean_ci.high),
            100.0 * below.value,
            (100.0 * below.ci.low, 100.0 * below.ci.high),
        ),
    ):
        axes.errorbar([x], [y], xerr=_reach(x, x_ends), yerr=_reach(y, y_ends), label=label, **look)


def _reach(middle: float, ends: tuple[float, float]) -> list[list[float]] | None:
    if np.isnan(ends).any():
        return None
    return [[max(0.0, middle - ends[0])], [max(0.0, ends[1] - middle)]]


def _common_field(points: tuple[Group, ...]) -> str:
    """Name the one field that all labels begin with; empty if there are several."""
    names = {point.label.partition(" = ")[0] for point in points}
    return names.pop() if len(names) == 1 else ""
