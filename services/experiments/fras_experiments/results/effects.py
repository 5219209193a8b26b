"""What each point of a sweep changes against the first, scene by scene."""

from dataclasses import dataclass
from typing import Final

from fras_experiments.results.comparison import pair, scaled
from fras_experiments.results.groups import MOST_POINTS, by_point
from fras_experiments.results.statistics import (
    PairedNumbers,
    PairedShares,
    paired_numbers,
    paired_shares,
)
from fras_experiments.results.trials import Trials

FEWEST_PAIRS: Final = 2


@dataclass(frozen=True)
class Effect:
    """A point of a sweep less the sweep's first point, over the scenes that both have.

    Attributes
    ----------
    label : str
    visibility : PairedNumbers [percentage points]
    force : PairedNumbers [N]
        Of the largest force.
    crossed : PairedShares
        Trials that went above the limit.
    """

    label: str
    visibility: PairedNumbers
    force: PairedNumbers
    crossed: PairedShares


def sweep_effects(trials: Trials, seed: int) -> tuple[str, tuple[Effect, ...]]:
    """Compare each point of a sweep with its first, pair by pair.

    Parameters
    ----------
    seed : int
        Of the bootstraps.

    Returns
    -------
    base : str
        Label of the first point.
    effects : tuple of Effect
        Empty where nothing is swept, where fields were sampled, and where a seed stands for several
        trials of a point.
    """
    points = by_point(trials)
    none = ("", ())
    if not 1 < len(points) <= MOST_POINTS or trials.planned_only:
        return none
    parts = [trials.where(point.chosen) for point in points]
    if any(len(set(part.seed.tolist())) < len(part) for part in parts):
        return none
    if sum(len(part) for part in parts) != len(trials):
        # Quarters of sampled fields: they share trials.
        return none
    found: list[Effect] = []
    for point, part in zip(points[1:], parts[1:], strict=True):
        if len(set(part.seed.tolist()) & set(parts[0].seed.tolist())) < FEWEST_PAIRS:
            continue
        pairs = pair(parts[0], part)
        found.append(
            Effect(
                point.label,
                _change(pairs.first, pairs.second, "visibility", seed),
                _change(pairs.first, pairs.second, "max_force_n", seed),
                paired_shares(pairs.first.crossed, pairs.second.crossed),
            )
        )
    return points[0].label, tuple(found)


def _change(first: Trials, second: Trials, name: str, seed: int) -> PairedNumbers:
    return paired_numbers(scaled(first, name), scaled(second, name), seed=seed)
