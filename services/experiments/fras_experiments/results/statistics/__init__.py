"""Numbers from samples: pure functions of arrays, random draws from a seed that is passed in."""

from fras_experiments.results.statistics.growth import Growth, growth
from fras_experiments.results.statistics.paired import (
    PairedNumbers,
    PairedShares,
    holm,
    paired_numbers,
    paired_shares,
)
from fras_experiments.results.statistics.samples import (
    Description,
    Interval,
    Share,
    bootstrap_interval,
    describe,
    difference_from_summary,
    difference_of_shares,
    share,
)
from fras_experiments.results.statistics.survival import Survival, survival

__all__ = [
    "Description",
    "Growth",
    "Interval",
    "PairedNumbers",
    "PairedShares",
    "Share",
    "Survival",
    "bootstrap_interval",
    "describe",
    "difference_from_summary",
    "difference_of_shares",
    "growth",
    "holm",
    "paired_numbers",
    "paired_shares",
    "share",
    "survival",
]
