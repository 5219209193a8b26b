"""One wide picture of a trial: the tissue before and after beside the course of the force."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type its **kwargs.

from collections.abc import Sequence

from matplotlib.figure import Figure

from fras_cli.report.figures.course import draw_force, draw_visibility
from fras_cli.report.figures.style import drawing
from fras_cli.report.figures.tissue import draw_views, make_stage
from fras_cli.report.story import PlanStory
from fras_cli.report.trial import Trial

WIDTH_IN, HEIGHT_IN, DPI = 11.5, 4.6, 140
TISSUE_WIDTH = 2.0


def picture_figure(trial: Trial, stories: Sequence[PlanStory]) -> Figure:
    """Tissue on the left where the log holds one, force and visibility on the right."""
    stage = make_stage(trial, highest=False)
    with drawing():
        figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), layout="constrained")
        halves = figure.add_gridspec(1, 2, width_ratios=[TISSUE_WIDTH, 1.0])
        if stage is not None:
            draw_views(figure.add_subfigure(halves[0]), stage)
        right = figure.add_subfigure(halves[1] if stage else halves[:])
        force, visibility = right.subplots(2, 1, sharex=True, height_ratios=[3, 2])
        draw_force(force, trial, stories, narrow=0.1)
        draw_visibility(visibility, trial, stories)
        visibility.set_xlabel("simulated time [s]")
    return figure
