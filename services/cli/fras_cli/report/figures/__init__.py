"""The figures of a report, each a function from a trial to a matplotlib `Figure`."""

from fras_cli.report.figures.course import course_figure
from fras_cli.report.figures.picture import DPI as PICTURE_DPI
from fras_cli.report.figures.picture import picture_figure
from fras_cli.report.figures.style import to_png, to_svg
from fras_cli.report.figures.timeline import timeline_figure
from fras_cli.report.figures.tissue import make_stage, tissue_figure

__all__ = [
    "PICTURE_DPI",
    "course_figure",
    "make_stage",
    "picture_figure",
    "timeline_figure",
    "tissue_figure",
    "to_png",
    "to_svg",
]
