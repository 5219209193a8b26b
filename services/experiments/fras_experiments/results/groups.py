"""Trials put together: by scenario kind, and by what was swept."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fras_experiments.results.trials import KINDS, Trials

MOST_POINTS: Final = 40
"""Of a sweep that is told point by point; beyond, fields were sampled, and quarters are told."""


@dataclass(frozen=True)
class Group:
    """Some of a campaign's trials.

    Attributes
    ----------
    label : str
    chosen : bool array, shape (n,)
        Of the campaign's trials.
    """

    label: str
    chosen: NDArray[np.bool_]


def by_kind(trials: Trials) -> tuple[Group, ...]:
    """All; each kind that occurs; B and C together, the trials that were planned anew."""
    found = [Group("all", np.ones(len(trials), dtype=np.bool_))]
    found += [Group(kind, trials.kind == kind) for kind in KINDS]
    found.append(Group("no plan", trials.kind == ""))
    both = np.isin(trials.kind, ("B", "C"))
    if all(np.any(trials.kind == kind) for kind in ("B", "C")):
        found.append(Group("B and C", both))
    return tuple(group for group in found if group.chosen.any())


def by_point(trials: Trials) -> tuple[Group, ...]:
    """Each point of the sweep, in the order in which they first occur; nothing without a sweep.

    A field that has the same value everywhere is not told. Where there are more than
    `MOST_POINTS` points, each field's quarters instead.
    """
    varied = {name: text for name, text in trials.swept.items() if np.unique(text).size > 1}
    if not varied:
        return ()
    names, points = list(varied), list(zip(*varied.values(), strict=True))
    order = list(dict.fromkeys(points))
    if len(order) > MOST_POINTS:
        return tuple(group for name, text in varied.items() for group in _quarters(name, text))
    # Of one factor at a time, all other fields have the first point's values: they go without.
    alone = _one_at_a_time(order)
    return tuple(
        Group(
            ", ".join(
                f"{name} = {value}"
                for name, value, first in zip(names, point, order[0], strict=True)
                if not alone or len(names) == 1 or value != first
            )
            or "base",
            np.array([one == point for one in points], dtype=np.bool_),
        )
        for point in order
    )


def _one_at_a_time(points: Sequence[tuple[str, ...]]) -> bool:
    """Whether fields change against the first point one by one, or always in the same company."""
    first = points[0]
    changed = {frozenset(i for i, one in enumerate(point) if one != first[i]) for point in points}
    fields = [field for together in changed for field in together]
    return len(fields) == len(set(fields))


def _quarters(name: str, text: NDArray[np.str_]) -> tuple[Group, ...]:
    """Quarters of a field of numbers; its values where they are words."""
    try:
        values = np.array([float(one) for one in text], dtype=np.float64)
    except ValueError:
        return tuple(Group(f"{name} = {value}", text == value) for value in np.unique(text))
    edges = np.unique(np.quantile(values, [0.0, 0.25, 0.5, 0.75, 1.0]))
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.size - 2)
    return tuple(
        Group(f"{name} in {edges[i]:.4g} to {edges[i + 1]:.4g}", place == i)
        for i in range(edges.size - 1)
    )
