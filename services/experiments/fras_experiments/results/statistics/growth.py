"""How fast a time grows with a size: the exponent p in t = c N^p."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fras_experiments.results.statistics.samples import CONFIDENCE, UNKNOWN, Interval

RESAMPLES: Final = 9_999

Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class Growth:
    """A power law through the medians, t = factor N^exponent.

    Attributes
    ----------
    ci : Interval
        95 %, of the exponent: percentiles of a bootstrap within each size. Unknown where no size
        has two values.
    r_squared : float
        Of log t against log N; far from 1 the growth is no power law.
    """

    exponent: float
    factor: float
    ci: Interval
    r_squared: float


def growth(times: Mapping[int, Numbers], *, seed: int) -> Growth | None:
    """Fit a power law to medians, by least squares of the logarithms.

    Parameters
    ----------
    times : mapping of int to ndarray
        By size N > 0, times > 0; NaN is left out.

    Returns
    -------
    Growth or None
        None below 3 sizes: through 2 points every law passes.
    """
    samples = {n: t[t > 0.0] for n, t in sorted(times.items())}
    samples = {n: t for n, t in samples.items() if t.size}
    if len(samples) < 3:
        return None
    log_n = np.log(np.array(list(samples), dtype=np.float64))
    log_t = np.log([np.median(t) for t in samples.values()])
    slopes, offsets = _lines(log_n, log_t[:, None])
    exponent, offset = float(slopes[0]), float(offsets[0])
    left = float(np.sum((log_t - offset - exponent * log_n) ** 2))
    spread = float(np.sum((log_t - log_t.mean()) ** 2))
    return Growth(
        exponent,
        math.exp(offset),
        _interval(log_n, list(samples.values()), seed),
        1.0 - left / spread if spread > 0.0 else math.nan,
    )


def _lines(log_n: Numbers, log_t: Numbers) -> tuple[Numbers, Numbers]:
    """Least squares of each column, shapes (n_sizes,) and (n_sizes, n_fits)."""
    centred = log_n - log_n.mean()
    slopes = centred @ log_t / float(centred @ centred)
    return slopes, log_t.mean(axis=0) - slopes * log_n.mean()


def _interval(log_n: Numbers, samples: list[Numbers], seed: int) -> Interval:
    if all(sample.size < 2 for sample in samples):
        return UNKNOWN
    random = np.random.default_rng(seed)
    medians = np.array(
        [
            np.median(sample[random.integers(sample.size, size=(RESAMPLES, sample.size))], axis=1)
            for sample in samples
        ]
    )
    slopes, _ = _lines(log_n, np.log(medians))
    tail = (1.0 - CONFIDENCE) / 2
    low, high = np.quantile(slopes, [tail, 1.0 - tail])
    return Interval(float(low), float(high))
