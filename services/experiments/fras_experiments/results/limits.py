"""How each pull of a campaign ended: at the limit, or below it."""

import math
from dataclasses import dataclass

import numpy as np

from fras_experiments.results.pulls import Pull, endurance
from fras_experiments.results.reading import Results


@dataclass(frozen=True)
class PullEnd:
    """A pull and how far it came.

    Attributes
    ----------
    row : int
        Of its trial, in the campaign's trials.
    limit_n : float
        Its soft limit [N].
    height_m : float
        At which it crossed it, or else its greatest height [m].
    crossed : bool
    stopped : bool
        Whether a crossing ends it: what it would have borne higher up was not seen.
    """

    pull: Pull
    row: int
    limit_n: float
    height_m: float
    crossed: bool
    stopped: bool


def pull_ends(results: Results) -> tuple[PullEnd, ...]:
    """Find how each pull ended; those of trials without a limit in their table are left out."""
    trials, stopped = results.trials, results.stopped
    by_trial = dict[str, list[Pull]]()
    for pull in results.pulls:
        by_trial.setdefault(pull.trial, []).append(pull)
    found = list[PullEnd]()
    for row, name in enumerate(trials.trial):
        pulls, limit_n = by_trial.get(str(name), []), float(trials.soft_limit_n[row])
        if not pulls or math.isnan(limit_n):
            continue
        crossings = 0 if math.isnan(trials.crossings[row]) else int(trials.crossings[row])
        ends = endurance(pulls, limit_n, crossings, stopped=bool(stopped[row]))
        for pull, height, crossed in zip(pulls, ends.height_m, ends.crossed, strict=True):
            height_m = float(height)
            if pull is pulls[-1] and crossed and stopped[row] and pull.force_n.max() <= limit_n:
                # Between two samples; the table has the greatest height of the last pull exactly.
                height_m = max(height_m, float(np.nan_to_num(trials.lift_m[row])))
            found.append(PullEnd(pull, row, limit_n, height_m, bool(crossed), bool(stopped[row])))
    return tuple(found)
