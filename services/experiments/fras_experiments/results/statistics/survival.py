"""Kaplan and Meier's curve: the share that has not had an event yet, with censored observations."""

# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportAttributeAccessIssue=false
# Reason: scipy ships no types.

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from fras_experiments.results.statistics.samples import CONFIDENCE

Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class Survival:
    """A step function: from `at[i]` on the share is `share[i]`; before `at[0]` it is 1.

    Attributes
    ----------
    at, share, low, high : Numbers, shape (n,)
        Where something happens, and the share with its pointwise 95 % limits (log-log, Greenwood).
        Before the first event both limits are 1, after the last survivor's both are 0: the
        estimate of the variance is zero there.
    events, n : int
    """

    at: Numbers
    share: Numbers
    low: Numbers
    high: Numbers
    events: int
    n: int

    def median(self) -> float:
        """Where half have had the event; NaN if fewer ever have."""
        below = np.flatnonzero(self.share <= 0.5)
        return float(self.at[below[0]]) if below.size else float("nan")

    def at_value(self, value: float) -> float:
        """Share that is left at a value."""
        place = int(np.searchsorted(self.at, value, side="right"))
        return float(self.share[place - 1]) if place else 1.0


def survival(values: Numbers, happened: NDArray[np.bool_]) -> Survival:
    """Estimate the curve.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Where the event happened, or how far it had not when the observation ended.
    happened : bool ndarray, shape (n,)
        False for censored observations.

    Raises
    ------
    ValueError
        There is no value, or the shapes differ.
    """
    if not values.size or values.shape != happened.shape:
        raise ValueError(f"values and events of shapes {values.shape} and {happened.shape}")
    sample = stats.CensoredData(uncensored=values[happened], right=values[~happened])
    curve = stats.ecdf(sample).sf
    # At shares of 1 and 0 the log-log limits are not defined, and scipy warns; see Attributes.
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore", RuntimeWarning)
        limits = curve.confidence_interval(confidence_level=CONFIDENCE, method="log-log")
    left = np.asarray(curve.probabilities, dtype=np.float64)
    low = np.asarray(limits.low.probabilities, dtype=np.float64)
    high = np.asarray(limits.high.probabilities, dtype=np.float64)
    return Survival(
        np.asarray(curve.quantiles, dtype=np.float64),
        left,
        np.where(np.isfinite(low), low, left),
        np.where(np.isfinite(high), high, left),
        int(happened.sum()),
        int(values.size),
    )
