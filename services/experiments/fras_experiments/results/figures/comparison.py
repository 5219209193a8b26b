"""Two campaigns pair by pair: visibility, force, and how trials ended."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fras_cli.report.figures.style import FAINT, INK, drawing, open_frame
from fras_experiments.results import words
from fras_experiments.results.comparison import Comparison, scaled
from fras_experiments.results.figures.style import WIDTH_IN

HEIGHT_IN: Final = 3.3
HIGHER: Final = "#d55e00"
LOWER: Final = "#0072b2"


def draw_comparison(comparison: Comparison, first: str, second: str) -> Figure:
    """Draw each pair's visibility and force, and how many endings changed.

    Parameters
    ----------
    first, second : str
        Names of the two.
    """
    with drawing():
        figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), layout="constrained")
        left, middle, right = figure.subplots(1, 3)
        _scatter(left, comparison, "visibility", "visibility [%]", "points")
        _scatter(middle, comparison, "max_force_n", "largest force [N]", "N")
        _endings(right, comparison)
        figure.legend(
            *left.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=7.5
        )
        figure.suptitle(
            f"A: {first}   B: {second}   {len(comparison.pairs.first)} pairs", fontsize=8.5
        )
    return figure


def _scatter(axes: Axes, comparison: Comparison, name: str, what: str, unit: str) -> None:
    one, two = scaled(comparison.pairs.first, name), scaled(comparison.pairs.second, name)
    both = ~(np.isnan(one) | np.isnan(two))
    one, two = one[both], two[both]
    # The same change looks alike in both panels; equal pairs are neither.
    for chosen, colour, mark, label in (
        (two > one, HIGHER, "^", "B higher"),
        (two < one, LOWER, "v", "B lower"),
        (two == one, FAINT, "o", "equal"),
    ):
        axes.scatter(
            one[chosen], two[chosen], s=13, color=colour, marker=mark, alpha=0.7, linewidths=0,
            label=label,
        )  # fmt: skip
    if one.size:
        low, high = float(min(one.min(), two.min())), float(max(one.max(), two.max()))
        room = 0.05 * (high - low) or 1.0
        axes.plot([low - room, high + room], [low - room, high + room], color=INK, linewidth=0.7)
        axes.set_xlim(low - room, high + room)
        axes.set_ylim(low - room, high + room)
    told = comparison.numbers[name]
    axes.set_title(
        f"B - A: {words.number(told.mean_difference)} {unit}\n{words.interval(told.mean_ci)}, "
        f"p {_p(comparison.adjusted_p[name])}",
        fontsize=8,
    )
    axes.set_xlabel(f"A: {what}")
    axes.set_ylabel(f"B: {what}")
    axes.set_box_aspect(1)
    open_frame(axes)


def _endings(axes: Axes, comparison: Comparison) -> None:
    """Draw how many succeed: in both, in A alone, in B alone, in neither."""
    told = comparison.shares["success"]
    both = told.first.count - told.lost
    counts = (both, told.lost, told.gained, told.first.n - both - told.lost - told.gained)
    names = ("both", "A alone", "B alone", "neither")
    colours = (FAINT, LOWER, HIGHER, "#444444")
    bars = axes.barh(range(4), counts, color=colours, height=0.6)
    axes.bar_label(bars, padding=2, fontsize=7.5)
    axes.set_yticks(range(4), names)
    axes.invert_yaxis()
    axes.set_xlim(right=1.15 * max(*counts, 1))
    axes.set_box_aspect(1)
    axes.set_xlabel("pairs that succeed in")
    axes.set_title(
        f"B - A: {words.percent(told.difference)} points\n{words.interval(told.ci, 1, 100.0)}, "
        f"p {_p(comparison.adjusted_p['success'])}",
        fontsize=8,
    )
    open_frame(axes)


def _p(value: float) -> str:
    told = words.probability(value)
    return told if told.startswith("<") else f"= {told}"
