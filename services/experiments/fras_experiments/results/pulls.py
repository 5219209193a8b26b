"""The pulls of a trial: force against height, and the height at which the limit was crossed."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

STRIDE_TICKS: Final = 5
"""The engine keeps every fifth tick; pulls are further apart, as a grasp lies between them."""


@dataclass(frozen=True)
class Series:
    """What was told while pulling, each array of shape (n,).

    Attributes
    ----------
    tick : int array
        Growing, at most `STRIDE_TICKS` apart within a pull.
    height_m : Numbers [m]
        Of the pulling tip above where the pull began.
    force_n : Numbers [N]
    visibility : Numbers
    """

    tick: NDArray[np.int64]
    height_m: Numbers
    force_n: Numbers
    visibility: Numbers


@dataclass(frozen=True)
class Pull:
    """One pull on its way up: from its first tick to its greatest height.

    Attributes
    ----------
    trial : str
    number : int
        From 0 within its trial; those after the first follow a re-plan.
    height_m, force_n : Numbers, shape (n,)
    """

    trial: str
    number: int
    height_m: Numbers
    force_n: Numbers


@dataclass(frozen=True)
class Endurance:
    """How far pulls came below a limit; arrays of shape (n,), in the order of the pulls.

    Attributes
    ----------
    height_m : Numbers [m]
        At which the limit was crossed; the greatest height where it was not.
    crossed : bool array
        Whether it was. False is a censored observation: the pull ended before.
    """

    height_m: Numbers
    crossed: NDArray[np.bool_]


def pulls_of(trial: str, series: Series) -> tuple[Pull, ...]:
    """Cut a series into its pulls, and each pull at its greatest height.

    What follows the greatest height is the retreat, in which the tissue has another history.
    """
    if not series.tick.size:
        return ()
    starts = np.flatnonzero(np.diff(series.tick) > STRIDE_TICKS) + 1
    found = list[Pull]()
    for rows in np.split(np.arange(series.tick.size), starts):
        up = rows[: int(np.argmax(series.height_m[rows])) + 1]
        found.append(Pull(trial, len(found), series.height_m[up], series.force_n[up]))
    return tuple(found)


def endurance(pulls: Sequence[Pull], limit_n: float, crossings: int, *, stopped: bool) -> Endurance:
    """Find how far each pull of one trial came below a limit.

    Parameters
    ----------
    limit_n : float
        Above it counts, as for situation awareness [N].
    crossings : int
        How often the trial went above it, by every tick.
    stopped : bool
        Whether a crossing ends a pull.

    Notes
    -----
    Between two samples force grows linearly. A pull that is stopped at its crossing may have no
    sample above the limit. Where fewer pulls have one than the trial has crossings, the lowest of
    the others are those that were stopped, at their greatest height.
    """
    found = [_crossing_m(pull, limit_n) for pull in pulls]
    crossed = np.array([height is not None for height in found], dtype=np.bool_)
    heights = np.array(
        [
            float(pull.height_m.max()) if height is None else height
            for pull, height in zip(pulls, found, strict=True)
        ],
        dtype=np.float64,
    )
    if stopped:
        untold = max(0, crossings - int(crossed.sum()))
        others = np.flatnonzero(~crossed)
        crossed[others[np.argsort(heights[others], kind="stable")][:untold]] = True
    return Endurance(heights, crossed)


def _crossing_m(pull: Pull, limit_n: float) -> float | None:
    above = np.flatnonzero(pull.force_n > limit_n)
    if not above.size:
        return None
    last = int(above[0])
    if last == 0:
        return float(pull.height_m[0])
    force, height = pull.force_n[last - 1 : last + 1], pull.height_m[last - 1 : last + 1]
    share = (limit_n - force[0]) / (force[1] - force[0])
    return float(height[0] + share * (height[1] - height[0]))


def on_grid(pulls: Iterable[Pull], height_m: Numbers) -> Numbers:
    """Interpolate forces at given heights, shape (n_pulls, n_heights) [N].

    NaN above a pull's greatest height and below its first: nothing is extrapolated.
    """
    rows = list[Numbers]()
    for pull in pulls:
        # The tip may sink by a hair between two ticks; np.interp needs heights that grow.
        rising = np.maximum.accumulate(pull.height_m)
        keep = np.append(True, np.diff(rising) > 0.0)
        rows.append(
            np.interp(height_m, rising[keep], pull.force_n[keep], left=np.nan, right=np.nan)
        )
    return np.array(rows, dtype=np.float64).reshape(-1, height_m.size)
