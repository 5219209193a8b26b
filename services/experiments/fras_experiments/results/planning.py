"""Planning times by N, the number of candidate grasping points along one side."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fras_experiments.results import paper
from fras_experiments.results.errors import BadResults
from fras_experiments.results.reading import Results
from fras_experiments.results.statistics import Growth, growth

BLOCKS: Final = "awareness.blocks"


@dataclass(frozen=True)
class Planning:
    """Planning times of a campaign.

    Attributes
    ----------
    first_s : dict of int to ndarray [s]
        Times of first plans by N, growing; none missing.
    growth : Growth or None
        None below 3 different N.
    """

    first_s: dict[int, NDArray[np.float64]]
    growth: Growth | None


def planning_of(results: Results, *, seed: int) -> Planning | None:
    """Gather first planning times; None where the campaign has none.

    Raises
    ------
    BadResults
        N of a trial is no whole number above 0.
    """
    if results.timing is None:
        return None
    times = results.timing.of(results.trials, "plan_first_s")
    blocks = results.settings(BLOCKS, str(paper.BLOCKS))
    known = ~np.isnan(times)
    for one in np.unique(blocks[known]):
        if not str(one).isdecimal() or int(one) < 1:
            raise BadResults(f"{results.folder}: {BLOCKS} = {one!s} is no number of blocks")
    sizes = sorted({int(one) for one in blocks[known]})
    by_size = {n: times[known & (blocks == str(n))] for n in sizes}
    return Planning(by_size, growth(by_size, seed=seed)) if by_size else None


def paper_growth(time_s: Callable[[int], float | None] = paper.plan_s) -> Growth:
    """Fit the same law to the means of the paper's Table I; no interval: it has one mean a size.

    Parameters
    ----------
    time_s : callable
        Mean time by N [s].
    """
    means = {n: np.array([time_s(n)], dtype=np.float64) for n in paper.PLAN_S}
    fit = growth(means, seed=0)
    if fit is None:
        raise ValueError("the paper's table has fewer than 3 sizes")
    return fit
