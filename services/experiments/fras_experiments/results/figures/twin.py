"""The model's error against the stiffness of the patient: limits missed, and true force."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fras_cli.report.figures.style import FAINT, INK, drawing, open_frame
from fras_experiments.results.errors import BadResults
from fras_experiments.results.figures.style import WIDTH_IN, spread
from fras_experiments.results.model_error import (
    SHIFT,
    STIFFNESS,
    ModelError,
    model_error,
    with_patient,
)
from fras_experiments.results.reading import Results

HEIGHT_IN: Final = 3.2
ASIDE: Final = 0.012
"""Of the next line, as a share of the width."""
MOST_TICKS: Final = 8
COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
LOOKS: Final = (("o", "-"), ("s", "--"), ("^", "-."), ("D", ":"), ("v", "-"), ("P", "--"))


def draw_twin(results: Results, seed: int) -> Figure | None:
    """Draw a line for each shift of the attachments; None where no trial has a patient.

    Raises
    ------
    BadResults
        Stiffness or shift of a trial is no number.
    """
    chosen = with_patient(results.trials)
    if not chosen.any():
        return None
    factors = _numbers(results, STIFFNESS, "1.0")
    shifts = _numbers(results, SHIFT, "0.0")
    lines = np.unique(shifts[chosen])
    width, places = float(np.ptp(factors[chosen])) or 1.0, np.unique(factors[chosen])
    with drawing():
        figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), layout="constrained")
        left, right = figure.subplots(1, 2)
        for place, shift in enumerate(lines):
            look = place % len(COLOURS)
            here = chosen & (shifts == shift)
            points = {
                float(factor): error
                for factor in np.unique(factors[here])
                if (error := model_error(results.trials.where(here & (factors == factor)), seed))
            }
            aside = ASIDE * width * (place - (lines.size - 1) / 2)
            label = f"attachments {1e3 * shift:g} mm off"
            _draw_missed(left, points, aside, look)
            _draw_ratio(right, points, aside, look, label, seed)
        left.set_ylim(-3.0, 103.0)
        left.set_ylabel("scenes with a missed limit [%]")
        right.axhline(1.0, color=INK, linewidth=0.7)
        right.set_yscale("log")
        right.set_ylabel("largest force, true / believed")
        ticks = [tick for tick in (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0) if _within(right, tick)]
        right.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
        right.minorticks_off()
        for axes in (left, right):
            axes.set_xlabel("Young's modulus, patient's / model's")
            if places.size <= MOST_TICKS:
                axes.set_xticks(places, [f"{factor:g}" for factor in places])
            axes.grid(color=FAINT, alpha=0.25, linewidth=0.5)
            open_frame(axes)
        handles, labels = right.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper left", ncols=3, fontsize=7.5)
    return figure


def _within(axes: Axes, value: float) -> bool:
    low, high = axes.get_ylim()
    return low <= value <= high


def _numbers(results: Results, path: str, default: str) -> NDArray[np.float64]:
    try:
        return np.array([float(one) for one in results.settings(path, default)], dtype=np.float64)
    except ValueError as error:
        raise BadResults(f"{results.folder}: {path}: {error}") from error


def _draw_missed(axes: Axes, points: dict[float, ModelError], aside: float, look: int) -> None:
    share = np.array([100.0 * one.missed.value for one in points.values()])
    low = np.array([100.0 * one.missed.ci.low for one in points.values()])
    high = np.array([100.0 * one.missed.ci.high for one in points.values()])
    mark, style = LOOKS[look]
    axes.errorbar(
        np.array(list(points)) + aside, share, yerr=np.abs([share - low, high - share]),
        color=COLOURS[look], marker=mark, linestyle=style, ms=5, linewidth=1.2, capsize=2,
        elinewidth=0.8,
    )  # fmt: skip


def _draw_ratio(
    axes: Axes, points: dict[float, ModelError], aside: float, look: int, label: str, seed: int
) -> None:
    mark, style = LOOKS[look]
    for factor, one in points.items():
        axes.scatter(
            factor + aside + spread(one.ratio.size, abs(ASIDE) / 4, seed), one.ratio,
            s=6, color=COLOURS[look], alpha=0.35, linewidths=0,
        )  # fmt: skip
    axes.plot(
        np.array(list(points)) + aside, [one.ratio_median for one in points.values()],
        color=COLOURS[look], marker=mark, linestyle=style, ms=5, linewidth=1.2, label=label,
    )  # fmt: skip
