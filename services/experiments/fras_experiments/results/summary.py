"""`summary.md`: a campaign in words, tables and figures."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fras_experiments.results import words
from fras_experiments.results.beside_paper import HEADER, beside_paper, conditions
from fras_experiments.results.groups import Group, by_kind, by_point
from fras_experiments.results.model_error import model_error_lines
from fras_experiments.results.planning import planning_of
from fras_experiments.results.planning_told import planning_lines
from fras_experiments.results.reading import Results
from fras_experiments.results.statistics import describe, share
from fras_experiments.results.trials import Trials

GROUP_HEADER: Final = (
    *("", "n", "success", "visibility [%]: mean [95 %]", "sd", "median"),
    *("largest force [N]: mean [95 %]", "sd", "median", "highest", "crossed the limit"),
    *("longest above [ticks]", "re-plans"),
)


FEW: Final = 20


def summary_lines(results: Results, figures: Mapping[str, str], *, seed: int) -> Iterator[str]:
    """Write the summary line by line.

    Parameters
    ----------
    figures : mapping of str to str
        Path of each figure, as seen from the summary, to its caption.
    seed : int
        Of every bootstrap.
    """
    trials = results.trials
    yield f"# Campaign {trials.campaign}"
    yield ""
    yield from _opening(results)
    if not len(trials):
        return
    if not trials.planned_only:
        yield from _retractions(results, seed)
    yield from model_error_lines(trials, seed)
    planning = planning_of(results, seed=seed)
    if planning is not None:
        yield from planning_lines(planning)
    if figures:
        yield "## Figures"
        yield ""
        for path, caption in figures.items():
            yield f"![{caption}]({path})"
            yield ""
            yield caption
            yield ""
    yield from _method(seed)


def _retractions(results: Results, seed: int) -> Iterator[str]:
    trials = results.trials
    yield "## By scenario kind"
    yield ""
    yield "A: one pull. B: a later plan moves to the side. C: a later plan releases, grasps anew."
    yield ""
    yield from group_table(trials, by_kind(trials), seed)
    points = by_point(trials)
    if points:
        yield "## By what was swept"
        yield ""
        yield from group_table(trials, points, seed)
    yield from _paper(results, seed)


def _opening(results: Results) -> Iterator[str]:
    trials, lost = results.trials, results.lost
    scenarios = ", ".join(f"`{name}`" for name in np.unique(trials.scenario))
    if len(trials):
        seeds = f"{np.unique(trials.seed).size} seeds in {trials.seed.min()}..{trials.seed.max()}"
        success = share(int(trials.success.sum()), len(trials))
        yield f"{len(trials)} trials of scenario {scenarios}, {seeds}."
        if trials.planned_only:
            yield "Each trial ends once its first plan is published: nothing is retracted."
        else:
            yield f"Success: {words.share(success)}."
    else:
        yield "**No trial is a result of its scene.**"
    yield ""
    others = Counter(
        f"{outcome}: {reason}" if reason else str(outcome)
        for outcome, reason in zip(
            trials.outcome[~trials.success], trials.reason[~trials.success], strict=True
        )
    )
    for ending, count in others.most_common():
        yield f"- {count} × {ending}"
    if len(lost):
        reasons = Counter(str(reason) for reason in lost.reason)
        told = "; ".join(f"{count} × {reason}" for reason, count in reasons.most_common())
        yield (
            f"- **{len(lost)} more trials are left out of all that follows**, as their stack or "
            f"worker died: {told}"
        )
    cut = int((~trials.complete).sum())
    if cut:
        yield f"- the log of {cut} trials is not whole; their numbers hold up to the cut"
    unseen = 0 if trials.planned_only else int(np.isnan(trials.visibility).sum())
    if unseen:
        yield f"- {unseen} trials have no visibility and are missing in its means"
    few = len(trials) < FEW
    if few:
        yield f"- fewer than {FEW} trials: bootstrap intervals of so few are too narrow"
    if few or len(lost) or cut or unseen or others:
        yield ""


def group_table(trials: Trials, groups: Sequence[Group], seed: int) -> Iterator[str]:
    """Write one row a group."""
    rows = list[tuple[str, ...]]()
    for group in groups:
        part = trials.where(group.chosen)
        seen = describe(100.0 * part.visibility, seed=seed)
        force = describe(part.max_force_n, seed=seed)
        counted = part.crossings[~np.isnan(part.crossings)]
        rows.append(
            (
                group.label,
                str(len(part)),
                words.share(share(int(part.success.sum()), len(part))),
                f"{words.number(seen.mean)} {words.interval(seen.mean_ci)}",
                words.number(seen.sd),
                words.number(seen.median),
                f"{words.number(force.mean, 3)} {words.interval(force.mean_ci, 3)}",
                words.number(force.sd, 3),
                words.number(force.median, 3),
                words.number(force.highest, 3),
                words.share(share(int((counted > 0).sum()), counted.size)),
                words.number(_highest(part.longest_above_ticks), 0),
                words.number(_mean(part.replans)),
            )
        )
    yield from words.table(GROUP_HEADER, rows)


def _highest(values: NDArray[np.float64]) -> float:
    present = values[~np.isnan(values)]
    return float(present.max()) if present.size else math.nan


def _mean(values: NDArray[np.float64]) -> float:
    present = values[~np.isnan(values)]
    return float(present.mean()) if present.size else math.nan


def _paper(results: Results, seed: int) -> Iterator[str]:
    rows = beside_paper(results, seed=seed)
    yield "## Beside the paper"
    yield ""
    yield from words.table(HEADER, rows)
    yield (
        "Differences of means by Welch, of shares by Newcombe, both between independent samples: "
        "the scenes are not the paper's. Where ours differ, what the paper leaves open may be "
        "the reason: mesh and element, which force is limited, how attachments are drawn, how "
        "far the region of interest is from them. Nothing is tuned to its numbers."
    )
    yield ""
    under = conditions(results)
    if under.careful.all() or under.ignoring.all():
        yield (
            "The paper's visibility is over scenarios A, B and C; this campaign has only trials "
            f"with attachments {'heeded (A, B)' if under.careful.all() else 'ignored (C)'}."
        )
        yield ""
    if len(by_point(results.trials)) > 1 and set(results.trials.swept) - {"planner.ignore_ap"}:
        yield (
            "This campaign sweeps more than the paper did, and the rows above are over all of "
            "its points: they are no like for like."
        )
        yield ""


def _method(seed: int) -> Iterator[str]:
    yield "## How these numbers are made"
    yield ""
    yield (
        f"Intervals are 95 %. Of means and medians: bootstrap, BCa, 9,999 resamples, seed {seed}; "
        "of shares: Wilson; of the survival curve: log-log with Greenwood's variance; of growth: "
        "bootstrap within each N. sd has n - 1 below. Trials of one seed under several "
        "conditions share a scene: to compare conditions use `fras experiment compare`, which "
        "pairs them."
    )
