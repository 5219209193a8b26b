"""Two campaigns over the same scenes, trial by trial."""

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fras_experiments.results.errors import BadResults
from fras_experiments.results.statistics import (
    PairedNumbers,
    PairedShares,
    holm,
    paired_numbers,
    paired_shares,
)
from fras_experiments.results.trials import Trials

NUMBERS: Final = {
    "visibility": "visibility [%]",
    "max_force_n": "force [N]",
    "longest_above_ticks": "ticks above limit",
    "replans": "re-plans",
    "ticks": "ticks",
    "lift_m": "lift [mm]",
}
"""Columns that are compared, with their labels: visibility at the end, largest force, longest time
above the limit in a pull, length of the trial, height of the last pull."""
SCALE: Final = {"visibility": 100.0, "lift_m": 1e3}
SHARES: Final = {"success": "success [%]", "crossed": "crossed limit [%]"}


@dataclass(frozen=True)
class Pairs:
    """Trials of two campaigns in the same order: the i-th of both have the same scene.

    Attributes
    ----------
    first, second : Trials
        Of the same length.
    by : tuple of str
        Columns that pair them.
    first_alone, second_alone : int
        Trials without a partner.
    """

    first: Trials
    second: Trials
    by: tuple[str, ...]
    first_alone: int
    second_alone: int


@dataclass(frozen=True)
class Comparison:
    """What changes from a first to a second campaign.

    Attributes
    ----------
    numbers : dict of str to PairedNumbers
        By column of `NUMBERS`, in the units of its label.
    shares : dict of str to PairedShares
        By entry of `SHARES`.
    adjusted_p : dict of str to float
        p of both, adjusted for their number by Holm.
    """

    pairs: Pairs
    numbers: dict[str, PairedNumbers]
    shares: dict[str, PairedShares]
    adjusted_p: dict[str, float]


def compare(first: Trials, second: Trials, *, seed: int) -> Comparison:
    """Pair two campaigns and test what changes.

    Parameters
    ----------
    seed : int
        Of the bootstraps.

    Raises
    ------
    BadResults
        They have no seed in common, or a seed stands for several trials.
    """
    pairs = pair(first, second)
    numbers = {
        name: paired_numbers(scaled(pairs.first, name), scaled(pairs.second, name), seed=seed)
        for name in NUMBERS
    }
    shares = {
        name: paired_shares(getattr(pairs.first, name), getattr(pairs.second, name))
        for name in SHARES
    }
    raw = {name: one.p for name, one in (*shares.items(), *numbers.items())}
    adjusted = dict(zip(raw, holm(list(raw.values())), strict=True))
    return Comparison(pairs, numbers, shares, adjusted)


def scaled(trials: Trials, name: str) -> NDArray[np.float64]:
    """Return a column of `NUMBERS` in the unit of its label, shape (n,)."""
    return SCALE.get(name, 1.0) * getattr(trials, name)


def pair(first: Trials, second: Trials) -> Pairs:
    """Pair by scenario and seed; by the fields that both sweep, too, where these are not enough.

    A field that has one value here and another one there is what is compared, and pairs nothing.
    The order of the rows is of no matter; the pairs come in the order of their keys.

    Raises
    ------
    BadResults
    """
    swept = sorted(first.swept.keys() & second.swept.keys())
    both = tuple(one for one in swept if not _apart(first.swept[one], second.swept[one]))
    by: tuple[str, ...] = ("scenario", "seed")
    ours, others = _rows(first, by), _rows(second, by)
    if both and not (_unique(ours) and _unique(others)):
        by = (*by, *both)
        ours, others = _rows(first, by), _rows(second, by)
    for trials, rows in ((first, ours), (second, others)):
        for key, places in rows.items():
            if len(places) > 1:
                raise _several(trials, by, key, places)
    common = sorted(ours.keys() & others.keys(), key=_order)
    if not common:
        raise BadResults(
            f"campaigns {first.campaign} and {second.campaign} have no {' and '.join(by)} in "
            f"common, so that nothing can be paired: {_span(first)}, and {_span(second)}",
            first=first.campaign,
            second=second.campaign,
        )
    return Pairs(
        _in_order(first, [ours[key][0] for key in common]),
        _in_order(second, [others[key][0] for key in common]),
        by,
        len(first) - len(common),
        len(second) - len(common),
    )


Key = tuple[Hashable, ...]


def _rows(trials: Trials, by: tuple[str, ...]) -> dict[Key, list[int]]:
    columns = [
        trials.scenario.tolist(),
        trials.seed.tolist(),
        *(trials.swept[name].tolist() for name in by[2:]),
    ]
    found = dict[Key, list[int]]()
    for row, key in enumerate(zip(*columns, strict=True)):
        found.setdefault(key, []).append(row)
    return found


def _apart(ours: NDArray[np.str_], others: NDArray[np.str_]) -> bool:
    """Whether a field has one value here and another one there: it is what is compared."""
    here, there = np.unique(ours), np.unique(others)
    return here.size == there.size == 1 and here[0] != there[0]


def _unique(rows: Mapping[Key, list[int]]) -> bool:
    return all(len(places) == 1 for places in rows.values())


def _order(key: Key) -> tuple[str, ...]:
    # A seed is a number; as text it is ordered by its length first.
    return tuple(f"{one:020d}" if isinstance(one, int) else str(one) for one in key)


def _in_order(trials: Trials, rows: list[int]) -> Trials:
    return trials.taken(np.array(rows, dtype=np.int64))


def _several(trials: Trials, by: tuple[str, ...], key: Key, places: list[int]) -> BadResults:
    told = ", ".join(f"{name} {value}" for name, value in zip(by, key, strict=True))
    names = ", ".join(str(trials.trial[place]) for place in places[:4])
    swept = ", ".join(trials.swept) or "nothing"
    return BadResults(
        f"campaign {trials.campaign}: {told} is that of {len(places)} trials ({names}), so that "
        f"they have no one partner; it sweeps {swept}: choose a point with --where, --where-a or "
        "--where-b FIELD=VALUE",
        campaign=trials.campaign,
        trials=[str(trials.trial[place]) for place in places],
    )


def _span(trials: Trials) -> str:
    if not len(trials):
        return f"{trials.campaign} has no trial"
    scenarios = ", ".join(np.unique(trials.scenario).tolist())
    return f"{trials.campaign} has {scenarios}, seeds {trials.seed.min()} to {trials.seed.max()}"


def chosen(trials: Trials, conditions: Mapping[str, str]) -> Trials:
    """Return the trials at one point of the sweep.

    Parameters
    ----------
    conditions : mapping of str to str
        Swept fields and the values that they shall have, as they stand in the table.

    Raises
    ------
    BadResults
        No such field is swept, or never has this value.
    """
    for name, value in conditions.items():
        if name not in trials.swept:
            raise BadResults(
                f"campaign {trials.campaign} does not sweep {name!r}: it sweeps "
                f"{', '.join(trials.swept) or 'nothing'}",
                field=name,
            )
        match = trials.swept[name] == value
        if not match.any():
            raise BadResults(
                f"campaign {trials.campaign}: {name} is never {value!r}; it is one of "
                f"{', '.join(np.unique(trials.swept[name]).tolist())}",
                field=name,
                value=value,
            )
        trials = trials.where(match)
    return trials
