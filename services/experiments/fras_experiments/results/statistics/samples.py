"""One sample: its moments with bootstrap intervals, and shares with Wilson's."""

# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportAttributeAccessIssue=false
# Reason: scipy ships no types.

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import stats

CONFIDENCE: Final = 0.95
RESAMPLES: Final = 9_999
LARGE: Final = 2_000
"""From this size on the percentile interval: BCa's jackknife is quadratic, and its gain is gone."""
BATCH_NUMBERS: Final = 4_000_000

Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class Interval:
    """A confidence interval; NaN on both sides where the sample does not allow one."""

    low: float
    high: float

    def holds(self, value: float) -> bool:
        """Whether a value lies within."""
        return self.low <= value <= self.high


UNKNOWN: Final = Interval(math.nan, math.nan)


@dataclass(frozen=True)
class Description:
    """A sample in numbers; NaN for what so few values do not have.

    Attributes
    ----------
    n : int
        Values; those that were missing are not among them.
    sd : float
        With n - 1 below.
    mean_ci : Interval
        95 %, bootstrap.
    """

    n: int
    mean: float
    sd: float
    median: float
    lowest: float
    highest: float
    mean_ci: Interval


@dataclass(frozen=True)
class Share:
    """How many of how many, with Wilson's 95 % interval."""

    count: int
    n: int
    ci: Interval

    @property
    def value(self) -> float:
        """The share, NaN of nothing."""
        return self.count / self.n if self.n else math.nan


def describe(values: Numbers, *, seed: int) -> Description:
    """Describe a sample.

    Parameters
    ----------
    values : ndarray, shape (n,)
        NaN stands for a missing value and is left out.
    seed : int
        Of the bootstrap: the same seed and sample give the same intervals.
    """
    present = values[~np.isnan(values)]
    if not present.size:
        nan = math.nan
        return Description(0, nan, nan, nan, nan, nan, UNKNOWN)
    return Description(
        n=int(present.size),
        mean=float(present.mean()),
        sd=float(present.std(ddof=1)) if present.size > 1 else math.nan,
        median=float(np.median(present)),
        lowest=float(present.min()),
        highest=float(present.max()),
        mean_ci=bootstrap_interval(present, np.mean, seed=seed),
    )


def bootstrap_interval(
    values: Numbers, statistic: Callable[..., Any], *, seed: int, confidence: float = CONFIDENCE
) -> Interval:
    """Bootstrap a statistic of one sample.

    Bias-corrected and accelerated (Efron 1987); percentiles where the acceleration is not defined
    (the jackknife of a median may have no spread) and for samples of 2,000 values or more.

    Parameters
    ----------
    values : ndarray, shape (n,)
        None of them NaN.
    statistic : callable
        Takes an array and `axis`.

    Returns
    -------
    Interval
        Unknown below 2 values. A point where all values are equal: resampling can't tell more.
    """
    if values.size < 2:
        return UNKNOWN
    if np.all(values == values[0]):
        return Interval(float(values[0]), float(values[0]))
    methods = ("percentile",) if values.size >= LARGE else ("BCa", "percentile")
    for method in methods:
        # Both warn where BCa is not defined, and then give NaN; the next method takes over.
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore", stats.DegenerateDataWarning)
            warnings.simplefilter("ignore", RuntimeWarning)
            found = stats.bootstrap(
                (values,),
                statistic,
                n_resamples=RESAMPLES,
                batch=max(1, BATCH_NUMBERS // values.size),
                confidence_level=confidence,
                method=method,
                vectorized=True,
                rng=np.random.default_rng(seed),
            ).confidence_interval
        if math.isfinite(found.low) and math.isfinite(found.high):
            return Interval(float(found.low), float(found.high))
    return UNKNOWN


def share(count: int, n: int, *, confidence: float = CONFIDENCE) -> Share:
    """Return a share with Wilson's interval (1927), which stays within 0 and 1 for small n, too."""
    if not n:
        return Share(0, 0, UNKNOWN)
    ci = stats.binomtest(count, n).proportion_ci(confidence_level=confidence, method="wilson")
    return Share(count, n, Interval(float(ci.low), float(ci.high)))


def difference_of_shares(first: Share, second: Share) -> Interval:
    """95 % interval of second - first for independent samples (Newcombe 1998, method 10)."""
    if not (first.n and second.n):
        return UNKNOWN
    change = second.value - first.value
    down = math.hypot(second.value - second.ci.low, first.ci.high - first.value)
    up = math.hypot(second.ci.high - second.value, first.value - first.ci.low)
    return Interval(change - down, change + up)


def difference_from_summary(
    mean: float, sd: float, n: int, other_mean: float, other_sd: float, other_n: int
) -> Interval:
    """95 % interval of mean - other_mean for independent samples (Welch), from summaries alone."""
    if n < 2 or other_n < 2 or not math.isfinite(sd):
        return UNKNOWN
    mine, others = sd**2 / n, other_sd**2 / other_n
    error = math.sqrt(mine + others)
    if error == 0.0:
        return Interval(mean - other_mean, mean - other_mean)
    freedom = (mine + others) ** 2 / (mine**2 / (n - 1) + others**2 / (other_n - 1))
    reach = float(stats.t.ppf(0.5 + CONFIDENCE / 2, freedom)) * error
    return Interval(mean - other_mean - reach, mean - other_mean + reach)
