"""Two samples of the same trials: how large the change is, and whether chance makes it."""

# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportAttributeAccessIssue=false
# Reason: scipy ships no types.

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from fras_experiments.results.statistics.samples import (
    UNKNOWN,
    Interval,
    Share,
    bootstrap_interval,
    share,
)

Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class PairedNumbers:
    """What changes from a first to a second sample, differences being second - first.

    Attributes
    ----------
    n, missing : int
        Pairs, and those left out as one of the two has no value.
    first_mean, second_mean, mean_difference, median_difference : float
    mean_ci : Interval
        95 %, of the mean difference, bootstrap over pairs.
    rank_biserial : float
        Kerby's matched-pairs rank-biserial correlation, -1 to 1: share of the ranks in favour of
        a growth less that of a fall. 0 where no pair differs.
    p : float
        Two-sided, Wilcoxon's signed-rank test, pairs without a difference left out; 1 where none
        differs.
    """

    n: int
    missing: int
    first_mean: float
    second_mean: float
    mean_difference: float
    median_difference: float
    mean_ci: Interval
    rank_biserial: float
    p: float


@dataclass(frozen=True)
class PairedShares:
    """What changes in a yes or no, from a first to a second sample.

    Attributes
    ----------
    gained, lost : int
        Pairs in which it holds in the second alone, and in the first alone.
    difference, ci : float, Interval
        second - first, with Newcombe's 95 % interval for paired shares (1998, method 10).
    p : float
        Two-sided, McNemar's exact test; 1 where no pair differs.
    """

    first: Share
    second: Share
    gained: int
    lost: int
    difference: float
    ci: Interval
    p: float


def paired_numbers(first: Numbers, second: Numbers, *, seed: int) -> PairedNumbers:
    """Compare two samples pair by pair.

    Parameters
    ----------
    first, second : ndarray, shape (n,)
        In the same order; a pair with NaN is left out.
    seed : int
        Of the bootstrap.

    Raises
    ------
    ValueError
        The shapes differ.
    """
    if first.shape != second.shape:
        raise ValueError(f"samples of shapes {first.shape} and {second.shape} are no pairs")
    both = ~(np.isnan(first) | np.isnan(second))
    one, two = first[both], second[both]
    missing = int(first.size - both.sum())
    if not one.size:
        nan = math.nan
        return PairedNumbers(0, missing, nan, nan, nan, nan, UNKNOWN, nan, nan)
    change = two - one
    moved = change[change != 0.0]
    return PairedNumbers(
        n=int(one.size),
        missing=missing,
        first_mean=float(one.mean()),
        second_mean=float(two.mean()),
        mean_difference=float(change.mean()),
        median_difference=float(np.median(change)),
        mean_ci=bootstrap_interval(change, np.mean, seed=seed),
        rank_biserial=_rank_biserial(moved),
        p=float(stats.wilcoxon(moved).pvalue) if moved.size else 1.0,
    )


def _rank_biserial(moved: Numbers) -> float:
    if not moved.size:
        return 0.0
    ranks = stats.rankdata(np.abs(moved))
    return float((ranks[moved > 0].sum() - ranks[moved < 0].sum()) / ranks.sum())


def paired_shares(first: NDArray[np.bool_], second: NDArray[np.bool_]) -> PairedShares:
    """Compare a yes or no pair by pair.

    Raises
    ------
    ValueError
        The shapes differ.
    """
    if first.shape != second.shape:
        raise ValueError(f"samples of shapes {first.shape} and {second.shape} are no pairs")
    n = int(first.size)
    gained, lost = int((second & ~first).sum()), int((first & ~second).sum())
    one, two = share(int(first.sum()), n), share(int(second.sum()), n)
    return PairedShares(
        one,
        two,
        gained,
        lost,
        (gained - lost) / n if n else math.nan,
        _newcombe(one, two, int((first & second).sum())),
        float(stats.binomtest(gained, gained + lost).pvalue) if gained + lost else 1.0,
    )


def _newcombe(first: Share, second: Share, both: int) -> Interval:
    """Newcombe's method 10 for the difference of paired shares.

    Notes
    -----
    Wilson's limits of both shares, joined under the correlation phi of the pairs; phi's numerator
    is drawn towards zero by n / 2 where it is positive. R. G. Newcombe, Statistics in Medicine 17
    (1998) 2635-2650.
    """
    n = first.n
    if not n:
        return UNKNOWN
    neither = n - first.count - second.count + both
    only_first, only_second = first.count - both, second.count - both
    product = math.sqrt(float(first.count) * (n - first.count) * second.count * (n - second.count))
    top = both * neither - only_first * only_second
    if top > 0:
        top = max(top - n / 2, 0.0)
    phi = top / product if product > 0.0 else 0.0
    change = second.value - first.value

    def reach(of_second: float, of_first: float) -> float:
        square = of_second**2 - 2 * phi * of_second * of_first + of_first**2
        return math.sqrt(max(square, 0.0))

    return Interval(
        change - reach(second.value - second.ci.low, first.ci.high - first.value),
        change + reach(second.ci.high - second.value, first.value - first.ci.low),
    )


def holm(p_values: Sequence[float]) -> tuple[float, ...]:
    """Adjust p-values for their number (Holm 1979); NaN stays and does not count."""
    order = sorted(
        (place for place, p in enumerate(p_values) if not math.isnan(p)),
        key=lambda place: p_values[place],
    )
    adjusted, highest = list(p_values), 0.0
    for rank, place in enumerate(order):
        highest = max(highest, min(1.0, (len(order) - rank) * p_values[place]))
        adjusted[place] = highest
    return tuple(adjusted)
