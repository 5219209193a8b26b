"""Recovery times by fault, each one a point."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

from pathlib import Path
from random import Random

from matplotlib.figure import Figure

from fras_cli.report.figures.style import FAINT, INK, LIMIT, drawing, open_frame, to_png
from fras_experiments.chaos.results import Campaign, named, percentile

GOALS_S = {"p50 goal": 2.0, "p95 goal": 5.0}
HELD = "#d55e00"
WENT_ON = "#0072b2"
WIDTH_IN, ROW_IN, DPI = 7.5, 0.3, 140


def draw_recovery(campaign: Campaign) -> Figure:
    """Draw each fault after which ticks stood still: how long, and how its trial ended."""
    found = {
        name: [(one.recovery_s, trial.outcome) for trial, one in pairs if one.recovery_s]
        for name, pairs in named(campaign).items()
    }
    names = [name for name, times in found.items() if times]
    with drawing():
        figure = Figure(figsize=(WIDTH_IN, 1.4 + ROW_IN * len(names)), layout="constrained")
        axes = figure.subplots()
        # The same results give the same picture.
        scatter = Random("fras chaos figure")
        for row, name in enumerate(reversed(names)):
            times = found[name]
            colours = [WENT_ON if outcome == "success" else HELD for _, outcome in times]
            heights = [row + scatter.uniform(-0.18, 0.18) for _ in times]
            axes.scatter([time_s for time_s, _ in times], heights, s=14, c=colours, alpha=0.75)
            middle = percentile(sorted(time_s for time_s, _ in times), 0.5) or 0.0
            axes.plot([middle, middle], [row - 0.32, row + 0.32], color=INK, linewidth=1.2)
        for label, goal_s in GOALS_S.items():
            axes.axvline(goal_s, color=LIMIT if label.startswith("p95") else FAINT, linestyle="--")
            axes.annotate(label, (goal_s, 1.0), xycoords=("data", "axes fraction"), fontsize=7)
        axes.set_yticks(range(len(names)), list(reversed(names)))
        axes.set_xlim(left=0.0)
        axes.set_xlabel("from the fault to the next tick [s]; blue: success, orange: held")
        open_frame(axes)
    return figure


def save_recovery(campaign: Campaign, path: Path) -> None:
    """Write the figure as PNG."""
    path.write_bytes(to_png(draw_recovery(campaign), DPI))
