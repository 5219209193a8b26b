"""The figures of a campaign, each a function from results to a matplotlib `Figure`."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from matplotlib.figure import Figure

from fras_experiments.results.figures.distributions import draw_distributions
from fras_experiments.results.figures.effects import draw_effects
from fras_experiments.results.figures.force import draw_force
from fras_experiments.results.figures.grasps import draw_grasps
from fras_experiments.results.figures.limit import draw_limit
from fras_experiments.results.figures.planning import draw_planning
from fras_experiments.results.figures.tradeoff import draw_tradeoff
from fras_experiments.results.figures.twin import draw_twin
from fras_experiments.results.reading import Results


@dataclass(frozen=True)
class Drawn:
    """A figure that every campaign can have.

    Attributes
    ----------
    draw : callable
        Takes results and the bootstraps' seed; None where the campaign has nothing to draw in it.
    caption : str
    """

    draw: Callable[[Results, int], Figure | None]
    caption: str


FIGURES: Final = {
    "distributions": Drawn(
        draw_distributions,
        "Visibility at the end and largest force, one point a trial, by scenario kind. Box: "
        "quarters and median; diamond: mean with its 95 % interval.",
    ),
    "force": Drawn(
        draw_force,
        "Force against height while pulling, by scenario kind: each pull, the median (first pulls "
        "solid, those after a re-plan dashed), and the middle half. A pull that was stopped at the "
        "limit counts as at the limit higher up.",
    ),
    "grasps": Drawn(
        draw_grasps,
        "Where grasps land: on the tissue, and seen from the region of interest; the area of a "
        "mark is the number of trials.",
    ),
    "limit": Drawn(
        draw_limit,
        "Survival of the limit (Kaplan-Meier, 95 % band): the share of pulls that are not yet "
        "above it, against height. Marks: pulls that ended below it.",
    ),
    "planning": Drawn(
        draw_planning,
        "Planning time against N on logarithmic axes, by f, the share that is attached: ours "
        "(points: trials; marks: medians; line: power law through them) and the paper's means "
        "(Table I, dashed). Beside it, where trials re-planned: B keeps the grasp, C releases it.",
    ),
    "tradeoff": Drawn(
        draw_tradeoff,
        "What is seen, and its price: visibility at the end against the share of trials that "
        "reached the limit, and scenes with less than 98 % in view against the largest force; a "
        "mark a point of the sweep, with 95 % intervals.",
    ),
    "effects": Drawn(
        draw_effects,
        "What each point of the sweep changes against the first one, over the same scenes: mean "
        "differences with their 95 % intervals, in colour where the interval does not hold zero.",
    ),
    "twin": Drawn(
        draw_twin,
        "A patient besides its model: the share of scenes in which the patient bore more than the "
        "limit and the model did not say so (with Wilson's 95 % interval), and the patient's "
        "largest force over the one believed (points: trials; marks: medians), against stiffness.",
    ),
}
