"""Visibility and force by scenario kind, one point a trial."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from fras_cli.report.figures.style import FAINT, INK, LIMIT, drawing, open_frame
from fras_experiments.results import paper
from fras_experiments.results.beside_paper import conditions
from fras_experiments.results.figures.style import (
    KIND_COLOURS,
    KIND_MARKS,
    MANY,
    PAPER,
    WIDTH_IN,
    kind_name,
    spread,
)
from fras_experiments.results.reading import Results
from fras_experiments.results.statistics import describe
from fras_experiments.results.trials import KINDS

HEIGHT_IN: Final = 3.5
BOX: Final = 0.2


def draw_distributions(results: Results, seed: int) -> Figure | None:
    """Draw both; None without a trial that was to retract something."""
    trials = results.trials
    if trials.planned_only:
        return None
    kinds = [kind for kind in (*KINDS, "") if (trials.kind == kind).any()]
    if not kinds:
        return None
    with drawing():
        figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), layout="constrained")
        left, right = figure.subplots(1, 2)
        _draw(left, [100.0 * trials.visibility[trials.kind == kind] for kind in kinds], kinds, seed)
        left.set_ylabel("visibility at the end [%]")
        left.set_title("Visibility")
        left.set_ylim(top=101.0)
        _line(left, 100.0 * paper.VISIBILITY.mean, PAPER, "paper's mean", ":")
        _draw(right, [trials.max_force_n[trials.kind == kind] for kind in kinds], kinds, seed)
        right.set_ylabel("largest force [N]")
        right.set_title("Force")
        right.set_ylim(bottom=0.0)
        limits = np.unique(trials.soft_limit_n[~np.isnan(trials.soft_limit_n)])
        if limits.size == 1:
            free = conditions(results).free.all()
            _line(right, float(limits[0]), LIMIT, "limit, switched off" if free else "limit", "--")
        if conditions(results).free.all():
            _line(right, paper.FORCE_NO_LIMIT_N.mean, PAPER, "paper's mean", ":")
        _legend(figure)
    return figure


def _draw(axes: Axes, samples: list[NDArray[np.float64]], kinds: list[str], seed: int) -> None:
    for place, (values, kind) in enumerate(zip(samples, kinds, strict=True)):
        present = values[~np.isnan(values)]
        axes.scatter(
            place + 0.12 + 0.12 + spread(present.size, 0.12, seed),
            present,
            s=11,
            marker=KIND_MARKS[kind],
            color=KIND_COLOURS[kind],
            alpha=0.65,
            rasterized=present.size > MANY,
            linewidths=0.6 if kind == "" else 0.0,
        )
        if not present.size:
            continue
        axes.boxplot(
            present,
            positions=[place - 0.12],
            widths=BOX,
            showfliers=False,
            manage_ticks=False,
            medianprops={"color": INK, "linewidth": 1.6},
            boxprops={"color": INK, "linewidth": 0.8},
            whiskerprops={"color": INK, "linewidth": 0.8},
            capprops={"color": INK, "linewidth": 0.8},
        )
        told = describe(present, seed=seed)
        reach = [[told.mean - told.mean_ci.low], [told.mean_ci.high - told.mean]]
        axes.errorbar(
            [place - 0.34],
            [told.mean],
            yerr=None if np.isnan(reach).any() else np.maximum(reach, 0.0),
            fmt="D",
            ms=4,
            color=KIND_COLOURS[kind],
            markeredgecolor=INK,
            markeredgewidth=0.6,
            ecolor=INK,
            elinewidth=1.0,
            capsize=2.5,
        )
    labels = [
        f"{kind_name(kind)}\nn = {int((~np.isnan(values)).sum())}"
        for values, kind in zip(samples, kinds, strict=True)
    ]
    axes.set_xticks(range(len(kinds)), labels)
    axes.set_xlim(-0.6, len(kinds) - 0.4)
    axes.set_xlabel("scenario kind")
    axes.grid(axis="y", color=FAINT, alpha=0.25, linewidth=0.5)
    open_frame(axes)


def _line(axes: Axes, value: float, colour: str, label: str, style: str) -> None:
    axes.axhline(value, color=colour, linestyle=style, linewidth=1.1, zorder=1, label=label)


def _legend(figure: Figure) -> None:
    """Explain lines and marks once, below both panels."""
    lines = {
        str(line.get_label()): line
        for axes in figure.axes
        for line in axes.get_lines()
        if not str(line.get_label()).startswith("_")
    }
    mean = Line2D([], [], linestyle="", marker="D", ms=4, color=FAINT, markeredgecolor=INK)
    figure.legend(
        [mean, *lines.values()],
        ["mean, 95 % interval", *lines],
        loc="outside lower center",
        ncols=4,
        fontsize=7.5,
    )
