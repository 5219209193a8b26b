"""Planning time against N, ours and the paper's."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, ScalarFormatter
from numpy.typing import NDArray

from fras_cli.report.figures.style import FAINT, INK, drawing, open_frame
from fras_experiments.results import paper
from fras_experiments.results.figures.style import PAPER, WIDTH_IN, spread
from fras_experiments.results.paper import Stated
from fras_experiments.results.planning import Cell, Planning, paper_growth, planning_of
from fras_experiments.results.planning_told import REPLAN_F, growth_words
from fras_experiments.results.reading import Results
from fras_experiments.results.statistics import Growth

HEIGHT_IN: Final = 3.3
LINE_IN: Final = 0.16
"""Of a legend above the axes."""
OURS: Final = "#0072b2"
COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#e69f00", "#56b4e9", "#999999")
MARKS: Final = ("o", "s", "^", "D", "v", "P")


@dataclass(frozen=True)
class _Line:
    """Our times under one condition, and the paper's means where it has them.

    Attributes
    ----------
    label : str
        "ours" where there is one condition only.
    """

    label: str
    times_s: Mapping[int, NDArray[np.float64]]
    growth: Growth | None
    paper_s: dict[int, float]
    colour: str
    mark: str


def draw_planning(results: Results, seed: int) -> Figure | None:
    """Draw first plans by f, and re-planning where there was any; None without any time."""
    planning = planning_of(results, seed=seed)
    if planning is None:
        return None
    anew = _anew(planning)
    width = WIDTH_IN if anew else 0.72 * WIDTH_IN
    with drawing():
        first = _first(planning)
        alone = len(first) == 1 and not anew
        height = HEIGHT_IN + (0.0 if alone else LINE_IN * (1 + max(len(first), len(anew))))
        figure = Figure(figsize=(width, height), layout="constrained")
        panels = figure.subplots(1, 1 + bool(anew), sharey=True, squeeze=False)[0]
        _draw(panels[0], first, "time to the first plan [ms]", seed, alone=alone)
        if anew:
            _draw(panels[1], anew, "", seed, alone=False)
            panels[1].set_ylabel("time to plan anew [ms]")
    return figure


def _first(planning: Planning) -> list[_Line]:
    if len(planning.by_fraction) < 2:
        means = {n: mean for n in paper.PLAN_S if (mean := paper.plan_s(n)) is not None}
        return [_Line("ours", planning.first_s, planning.growth, means, OURS, "o")]
    return _lines("f", planning.by_fraction, paper.plan_at, 0)


def _anew(planning: Planning) -> list[_Line]:
    def of(table: dict[int, Stated]) -> Callable[[int, float], Stated | None]:
        return lambda n, f: table.get(n) if abs(f - REPLAN_F) < 1e-6 else None

    moved = _lines("B, f", planning.move, of(paper.REPLAN_B_S), 0)
    return moved + _lines("C, f", planning.release, of(paper.REPLAN_C_S), len(moved))


def _lines(
    name: str,
    cells: tuple[Cell, ...],
    stated: Callable[[int, float], Stated | None],
    first: int,
) -> list[_Line]:
    found = list[_Line]()
    for place, cell in enumerate(cells, first):
        means = {n: one.mean for n in paper.PLAN_S if (one := stated(n, cell.fraction))}
        label = f"{name} = {100 * cell.fraction:g} %"
        look = place % len(COLOURS)
        found.append(_Line(label, cell.times_s, cell.growth, means, COLOURS[look], MARKS[look]))
    return found


def _draw(axes: Axes, lines: list[_Line], ylabel: str, seed: int, *, alone: bool) -> None:
    sizes = sorted({n for line in lines for n in (*line.times_s, *line.paper_s)})
    for place, line in enumerate(lines):
        _draw_ours(axes, line, 1.0 + 0.018 * (place - (len(lines) - 1) / 2), alone, seed)
    for place, line in enumerate(lines):
        _draw_paper(axes, line, alone, told=place == 0)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(sizes, [str(n) for n in sizes])
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_major_formatter(ScalarFormatter())
    axes.minorticks_off()
    axes.set_xlabel("N, candidate grasping points along a side")
    axes.set_ylabel(ylabel)
    axes.grid(color=FAINT, alpha=0.25, linewidth=0.5)
    if alone:
        axes.legend(loc="center left", fontsize=7.5)
    else:
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), fontsize=7.5)
    open_frame(axes)


def _draw_ours(axes: Axes, line: _Line, aside: float, alone: bool, seed: int) -> None:
    for n, times in line.times_s.items():
        axes.scatter(
            aside * n * np.exp(spread(times.size, 0.015 if alone else 0.005, seed)),
            1e3 * times, s=6, color=line.colour, alpha=0.3, linewidths=0,
        )  # fmt: skip
    fit = line.growth
    told = f"{line.label}{', median' if alone else ''}"
    axes.plot(
        aside * np.array(list(line.times_s)),
        [1e3 * float(np.median(times)) for times in line.times_s.values()],
        linestyle="", marker=line.mark, ms=5 if alone else 4, color=line.colour,
        markeredgecolor=INK, markeredgewidth=0.6, zorder=3,
        label=told if alone or fit is None else f"{told}: {growth_words(fit)}",
    )  # fmt: skip
    if fit is None:
        return
    grid = np.geomspace(min(line.times_s), max(line.times_s), 50)
    axes.plot(
        aside * grid, 1e3 * fit.factor * grid**fit.exponent, color=line.colour,
        linewidth=1.2 if alone else 0.9, label=f"ours: {growth_words(fit)}" if alone else None,
    )  # fmt: skip


def _draw_paper(axes: Axes, line: _Line, alone: bool, *, told: bool) -> None:
    if not line.paper_s:
        return
    label = f"paper's means: {growth_words(paper_growth())}" if alone else "paper's means"
    axes.plot(
        list(line.paper_s), [1e3 * mean for mean in line.paper_s.values()],
        linestyle="--", marker="s" if alone else line.mark, ms=5 if alone else 4,
        color=PAPER if alone else line.colour, markeredgecolor=PAPER if not alone else INK,
        linewidth=1.0, label=label if told else None,
    )  # fmt: skip
