"""Planning times by N, the number of candidate grasping points along one side, and by f."""

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
FRACTION: Final = "generator.attached_fraction"
USUAL_FRACTION: Final = "0.4"

Times = dict[int, NDArray[np.float64]]


@dataclass(frozen=True)
class Cell:
    """Times under one condition, by N.

    Attributes
    ----------
    fraction : float
        f, the share of the tissue that is attached.
    times_s : dict of int to ndarray [s]
        By N, growing; none missing.
    growth : Growth or None
        None below 3 different N.
    """

    fraction: float
    times_s: Times
    growth: Growth | None


@dataclass(frozen=True)
class Planning:
    """Planning times of a campaign.

    Attributes
    ----------
    through_service : bool
        Whether times are those through the planner, from context to plan; or of grounding and
        solving alone, which is all that older tables have.
    first_s : dict of int to ndarray [s]
        Times of first plans by N, growing; none missing.
    growth : Growth or None
        None below 3 different N.
    solver_s : dict of int to ndarray [s]
        Grounding and solving alone, of the same plans.
    solver_growth : Growth or None
    by_fraction : tuple of Cell
        Times of first plans by f and N, f growing.
    move, release : tuple of Cell
        Times of re-planning, by f and N: the grasp is kept (scenario B) or released (C). A trial
        that did both is in both.
    """

    through_service: bool
    first_s: Times
    growth: Growth | None
    solver_s: Times
    solver_growth: Growth | None
    by_fraction: tuple[Cell, ...]
    move: tuple[Cell, ...]
    release: tuple[Cell, ...]


def planning_of(results: Results, *, seed: int) -> Planning | None:
    """Gather planning times; None where the campaign has none.

    Raises
    ------
    BadResults
        N of a trial is no whole number above 0, or f no number.
    """
    timing, trials = results.timing, results.trials
    if timing is None:
        return None
    through = timing.of(trials, "plan_service_s")
    through_service = bool((~np.isnan(through)).any())
    alone = timing.of(trials, "plan_first_s")
    times = through if through_service else alone
    blocks = _blocks(results, ~np.isnan(times))
    fractions = _fractions(results)
    by_size = _by_size(times, blocks)
    if not by_size:
        return None
    solver = _by_size(alone, blocks)
    anew = [timing.of(trials, name) for name in ("replan_move_s", "replan_release_s")]
    return Planning(
        through_service,
        by_size,
        growth(by_size, seed=seed),
        solver,
        growth(solver, seed=seed),
        *(_cells(one, blocks, fractions, seed) for one in (times, *anew)),
    )


def _blocks(results: Results, known: NDArray[np.bool_]) -> NDArray[np.int64]:
    texts = results.settings(BLOCKS, str(paper.BLOCKS))
    for one in np.unique(texts[known]):
        if not str(one).isdecimal() or int(one) < 1:
            raise BadResults(f"{results.folder}: {BLOCKS} = {one!s} is no number of blocks")
    numbers = [int(one) if has else 0 for one, has in zip(texts, known, strict=True)]
    return np.array(numbers, dtype=np.int64)


def _fractions(results: Results) -> NDArray[np.float64]:
    texts = results.settings(FRACTION, USUAL_FRACTION)
    try:
        return np.array([float(one) for one in texts], dtype=np.float64)
    except ValueError as error:
        raise BadResults(f"{results.folder}: {FRACTION}: {error}") from error


def _cells(
    times: NDArray[np.float64], blocks: NDArray[np.int64], f: NDArray[np.float64], seed: int
) -> tuple[Cell, ...]:
    found = list[Cell]()
    for one in np.unique(f[~np.isnan(times)]):
        by_size = _by_size(np.where(f == one, times, np.nan), blocks)
        found.append(Cell(float(one), by_size, growth(by_size, seed=seed)))
    return tuple(found)


def _by_size(times: NDArray[np.float64], blocks: NDArray[np.int64]) -> Times:
    known = ~np.isnan(times) & (blocks > 0)
    return {int(n): times[known & (blocks == n)] for n in np.unique(blocks[known])}


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
