"""The paper's numbers and ours side by side, with what can honestly be said of the difference."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fras_experiments.results import paper, words
from fras_experiments.results.paper import Stated
from fras_experiments.results.reading import Results
from fras_experiments.results.statistics import (
    Description,
    Interval,
    describe,
    difference_from_summary,
    difference_of_shares,
    share,
)

TOO_FEW: Final = "too few trials to tell"
HEADER: Final = ("what", "paper", "ours", "ours - paper, 95 %", "in words")
Chosen = NDArray[np.bool_]


@dataclass(frozen=True)
class Conditions:
    """Under which of the paper's conditions each trial ran; bool arrays of shape (n,).

    Attributes
    ----------
    limited, free : bool array
        With the force limit, and without.
    careful, ignoring : bool array
        Attachment points heeded in the first plan (scenarios A and B), and ignored (C).
    """

    limited: Chosen
    free: Chosen
    careful: Chosen
    ignoring: Chosen


def conditions(results: Results) -> Conditions:
    """Tell the trials' conditions from the sweep, the campaign and its base scenario."""
    limited = results.stopped
    ignoring = results.settings("planner.ignore_ap", "false") == "true"
    return Conditions(limited, ~limited, ~ignoring, ignoring)


def beside_paper(results: Results, *, seed: int) -> tuple[tuple[str, ...], ...]:
    """Return the rows that the campaign has trials for, as `HEADER` names their cells."""
    return tuple(_rows(results, seed))


def _rows(results: Results, seed: int) -> Iterator[tuple[str, ...]]:
    trials, under = results.trials, conditions(results)
    visibility = 100.0 * trials.visibility
    replanned = np.isin(trials.kind, ("B", "C"))
    yield from _mean(
        "visibility at the end [%], A, B and C",
        _percent(paper.VISIBILITY),
        describe(visibility[under.limited], seed=seed),
    )
    yield from _mean(
        "visibility at the end [%], re-planned (B and C)",
        _percent(paper.VISIBILITY_REPLANNED),
        describe(visibility[under.limited & replanned], seed=seed),
    )
    yield from _share(
        "moved after a crossing (B), attachments heeded",
        paper.REPLANNED_B,
        trials.kind[under.limited & under.careful] == "B",
    )
    yield from _share(
        "released and grasped anew (C), attachments ignored",
        paper.REPLANNED_C,
        trials.kind[under.limited & under.ignoring] == "C",
    )
    force = describe(trials.max_force_n[under.free], seed=seed)
    yield from _mean("largest force without limit [N]", paper.FORCE_NO_LIMIT_N, force)
    if force.n and paper.FORCE_NO_LIMIT_N.highest is not None:
        peak = paper.FORCE_NO_LIMIT_N.highest
        yield (
            "peak of it [N]",
            words.number(peak),
            words.number(force.highest),
            words.number(force.highest - peak),
            f"the highest of {force.n}, an extreme: no test applies",
        )


def _percent(stated: Stated) -> Stated:
    sd = None if stated.sd is None else 100.0 * stated.sd
    return Stated(100.0 * stated.mean, sd, stated.n)


def _mean(what: str, theirs: Stated, ours: Description) -> Iterator[tuple[str, ...]]:
    if not ours.n:
        return
    ours_told = f"{words.number(ours.mean)} ± {words.number(ours.sd)} (n = {ours.n})"
    if theirs.sd is None:
        yield (
            what,
            f"{words.number(theirs.mean)} (n = {theirs.n})",
            ours_told,
            words.number(ours.mean - theirs.mean),
            _without_spread(theirs, ours),
        )
        return
    ci = difference_from_summary(ours.mean, ours.sd, ours.n, theirs.mean, theirs.sd, theirs.n)
    yield (
        what,
        f"{words.number(theirs.mean)} ± {words.number(theirs.sd)} (n = {theirs.n})",
        ours_told,
        f"{words.number(ours.mean - theirs.mean)} {words.interval(ci)}",
        judged(ci),
    )


def _without_spread(theirs: Stated, ours: Description) -> str:
    if not math.isfinite(ours.mean_ci.low):
        return TOO_FEW
    place = "within" if ours.mean_ci.holds(theirs.mean) else "outside"
    interval = words.interval(ours.mean_ci)
    return f"the paper gives no spread; its mean lies {place} our interval {interval}"


def _share(what: str, count: int, ours: Chosen) -> Iterator[tuple[str, ...]]:
    if not ours.size:
        return
    theirs = share(count, paper.SIMULATIONS)
    mine = share(int(ours.sum()), int(ours.size))
    ci = difference_of_shares(theirs, mine)
    change = 100.0 * (mine.value - theirs.value)
    yield (
        f"{what} [%]",
        words.share(theirs),
        words.share(mine),
        f"{words.number(change, 1)} {words.interval(ci, 1, 100.0)}",
        judged(ci),
    )


def judged(ci: Interval) -> str:
    """Say whether a difference, ours - paper, is told apart from none."""
    if not math.isfinite(ci.low):
        return TOO_FEW
    if ci.low > 0.0:
        return "**ours is higher**"
    if ci.high < 0.0:
        return "**ours is lower**"
    return "not told apart from the paper's"
