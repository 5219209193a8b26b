"""Planning time against N, ours and the paper's."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

from typing import Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, ScalarFormatter

from fras_cli.report.figures.style import FAINT, INK, drawing, open_frame
from fras_experiments.results import paper
from fras_experiments.results.figures.style import PAPER, WIDTH_IN, spread
from fras_experiments.results.planning import paper_growth, planning_of
from fras_experiments.results.reading import Results
from fras_experiments.results.summary import growth_words

HEIGHT_IN: Final = 3.3
OURS: Final = "#0072b2"


def draw_planning(results: Results, seed: int) -> Figure | None:
    """Draw all first plans; None where no time was kept."""
    planning = planning_of(results, seed=seed)
    if planning is None:
        return None
    with drawing():
        figure = Figure(figsize=(0.72 * WIDTH_IN, HEIGHT_IN), layout="constrained")
        axes = figure.subplots()
        sizes = list(planning.first_s)
        for n, times in planning.first_s.items():
            axes.scatter(
                n * np.exp(spread(times.size, 0.015, seed)), 1e3 * times, s=6, color=OURS,
                alpha=0.3, linewidths=0,
            )  # fmt: skip
        medians = [1e3 * float(np.median(times)) for times in planning.first_s.values()]
        axes.plot(
            sizes, medians, linestyle="", marker="o", ms=5, color=OURS, markeredgecolor=INK,
            label="ours, median",
        )  # fmt: skip
        if planning.growth is not None:
            grid = np.geomspace(sizes[0], sizes[-1], 50)
            axes.plot(
                grid, 1e3 * planning.growth.factor * grid**planning.growth.exponent, color=OURS,
                linewidth=1.2, label=f"ours: {growth_words(planning.growth)}",
            )  # fmt: skip
        theirs = list(paper.PLAN_S)
        means = [1e3 * time_s for n in theirs if (time_s := paper.plan_s(n)) is not None]
        axes.plot(
            theirs, means, linestyle="--", marker="s", ms=5, color=PAPER, markeredgecolor=INK,
            linewidth=1.0, label=f"paper's means: {growth_words(paper_growth())}",
        )  # fmt: skip
        axes.set_xscale("log")
        axes.set_yscale("log")
        ticks = sorted({*sizes, *theirs})
        axes.set_xticks(ticks, [str(n) for n in ticks])
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.yaxis.set_major_formatter(ScalarFormatter())
        axes.minorticks_off()
        axes.set_xlabel("N, candidate grasping points along a side")
        axes.set_ylabel("time to the first plan [ms]")
        axes.grid(color=FAINT, alpha=0.25, linewidth=0.5)
        axes.legend(loc="center left", fontsize=7.5)
        open_frame(axes)
    return figure
