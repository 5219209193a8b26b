"""How far the model of a patient's tissue was wrong, and which limits that made it miss."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fras_experiments.results import words
from fras_experiments.results.groups import by_point
from fras_experiments.results.statistics import (
    Interval,
    Share,
    bootstrap_interval,
    describe,
    share,
)
from fras_experiments.results.trials import Trials

STIFFNESS: Final = "patient.young_modulus_factor"
SHIFT: Final = "patient.disc_shift_m"
HEADER: Final = (
    *("", "n", "missed the limit", "never noticed it", "true / believed force: median [95 %]"),
    *("lowest", "highest", "true force [N]: median", "highest"),
)


@dataclass(frozen=True)
class ModelError:
    """The model's error over some trials with a patient.

    Attributes
    ----------
    missed : Share
        Of trials in which the patient bore more than the soft limit in a tick in which the model
        did not say so.
    unnoticed : Share
        Of trials in which the patient bore more than it, and the model never said so.
    ratio : ndarray, shape (n,)
        Largest force of the patient over the largest that the model told, trial by trial.
    ratio_median, ratio_ci : float, Interval
    """

    missed: Share
    unnoticed: Share
    ratio: NDArray[np.float64]
    ratio_median: float
    ratio_ci: Interval


def with_patient(trials: Trials) -> NDArray[np.bool_]:
    """Tell which trials have a patient that bore something, shape (n,)."""
    return ~np.isnan(trials.patient_max_force_n)


def model_error(trials: Trials, seed: int) -> ModelError | None:
    """Gather the error over the trials with a patient; None where there is none."""
    own = trials.where(with_patient(trials))
    if not len(own):
        return None
    above = own.patient_max_force_n > own.soft_limit_n
    unnoticed = above & ~(own.max_force_n > own.soft_limit_n)
    believed = np.where(own.max_force_n > 0.0, own.max_force_n, np.nan)
    ratio = own.patient_max_force_n / believed
    ratio = ratio[~np.isnan(ratio)]
    return ModelError(
        share(int((own.missed_ticks > 0).sum()), len(own)),
        share(int(unnoticed.sum()), len(own)),
        ratio,
        float(np.median(ratio)) if ratio.size else math.nan,
        bootstrap_interval(ratio, np.median, seed=seed),
    )


def model_error_lines(trials: Trials, seed: int) -> Iterator[str]:
    """Write the section; nothing where no trial has a patient."""
    own = trials.where(with_patient(trials))
    if not len(own):
        return
    yield "## Model error"
    yield ""
    yield (
        "The patient's tissue is another than its model. Missed the limit: scenes in which the "
        "patient bore more than the soft limit in at least one tick in which the model did not "
        "say so. Never noticed it: those of them in which the model stayed below it all the time. "
        "Forces are the largest of each trial."
    )
    yield ""
    points = by_point(own)
    parts = [("all", own), *((point.label, own.where(point.chosen)) for point in points)]
    yield from words.table(HEADER, [_row(label, part, seed) for label, part in parts])


def _row(label: str, part: Trials, seed: int) -> tuple[str, ...]:
    error, true = model_error(part, seed), describe(part.patient_max_force_n, seed=seed)
    if error is None:
        raise ValueError("a row of trials without a patient")
    some = error.ratio.size > 0
    return (
        label,
        str(len(part)),
        words.share(error.missed),
        words.share(error.unnoticed),
        f"{words.number(error.ratio_median)} {words.interval(error.ratio_ci)}",
        words.number(float(error.ratio.min())) if some else words.NONE,
        words.number(float(error.ratio.max())) if some else words.NONE,
        words.number(true.median, 3),
        words.number(true.highest, 3),
    )
