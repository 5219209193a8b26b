"""A comparison as a table on the terminal, and as JSON."""

import math
from typing import Any, Final

import numpy as np
from rich.box import SIMPLE
from rich.markup import escape
from rich.table import Table

from fras_experiments.results import words
from fras_experiments.results.comparison import NUMBERS, SHARES, Comparison
from fras_experiments.results.statistics import Interval

DIGITS: Final = {"max_force_n": 3}


def comparison_table(comparison: Comparison, first: str, second: str) -> Table:
    """Make the table.

    Parameters
    ----------
    first, second : str
        Names of the two.
    """
    title = f"{len(comparison.pairs.first)} pairs\nA: {escape(first)}\nB: {escape(second)}"
    table = Table(title=title, title_justify="left", box=SIMPLE, padding=(0, 1, 0, 0))
    table.add_column("", no_wrap=True)
    for name in ("A", "B", "B - A", "95 %", "effect", "p"):
        table.add_column(name, justify="right", no_wrap=True)
    for name, one in comparison.shares.items():
        table.add_row(
            escape(SHARES[name]),
            words.percent(one.first.value),
            words.percent(one.second.value),
            words.percent(one.difference),
            escape(words.interval(one.ci, 1, 100.0)),
            f"+{one.gained} -{one.lost}",
            words.probability(comparison.adjusted_p[name]),
        )
    for name, one in comparison.numbers.items():
        table.add_row(
            escape(NUMBERS[name]),
            words.number(one.first_mean),
            words.number(one.second_mean),
            words.number(one.mean_difference, DIGITS.get(name, 2)),
            escape(words.interval(one.mean_ci, DIGITS.get(name, 2))),
            words.number(one.rank_biserial),
            words.probability(comparison.adjusted_p[name]),
        )
    return table


def footnotes(comparison: Comparison) -> str:
    """Say how pairs were made, what was left out, and what the columns mean."""
    pairs = comparison.pairs
    alone = (
        f" Without a partner: {pairs.first_alone} of A, {pairs.second_alone} of B."
        if pairs.first_alone or pairs.second_alone
        else ""
    )
    dependent = (
        " Pairs of one seed share a scene: the intervals are narrower than they should be; "
        "choose one point with --where."
        if len(pairs.by) > 2 and len(pairs.first) > np.unique(pairs.first.seed).size
        else ""
    )
    missing = ", ".join(
        f"{NUMBERS[name]} {one.missing}" for name, one in comparison.numbers.items() if one.missing
    )
    unknown = f" Pairs without a value: {missing}." if missing else ""
    return (
        f"Paired by {', '.join(pairs.by)}.{alone}{unknown}{dependent} Means, their difference "
        "(bootstrap over pairs), Wilcoxon's signed-rank test; effect: the rank-biserial "
        "correlation, -1 to 1. Shares (Newcombe), McNemar's exact test; effect: pairs that gained "
        "and lost it. p is adjusted for the number of rows (Holm)."
    )


def as_plain(comparison: Comparison, first: str, second: str, seed: int) -> dict[str, Any]:
    """Return everything as JSON has it; what is unknown is null."""
    pairs = comparison.pairs
    return {
        "a": first,
        "b": second,
        "seed": seed,
        "pairs": len(pairs.first),
        "paired_by": list(pairs.by),
        "a_alone": pairs.first_alone,
        "b_alone": pairs.second_alone,
        "shares": {
            name: {
                "n": one.first.n,
                "a": _finite(one.first.value),
                "b": _finite(one.second.value),
                "gained": one.gained,
                "lost": one.lost,
                "difference": _finite(one.difference),
                "difference_95": _ends(one.ci),
                "p_mcnemar": one.p,
                "p_holm": comparison.adjusted_p[name],
            }
            for name, one in comparison.shares.items()
        },
        "numbers": {
            name: {
                "label": NUMBERS[name],
                "n": one.n,
                "missing": one.missing,
                "a_mean": _finite(one.first_mean),
                "b_mean": _finite(one.second_mean),
                "mean_difference": _finite(one.mean_difference),
                "mean_difference_95": _ends(one.mean_ci),
                "median_difference": _finite(one.median_difference),
                "rank_biserial": _finite(one.rank_biserial),
                "p_wilcoxon": _finite(one.p),
                "p_holm": _finite(comparison.adjusted_p[name]),
            }
            for name, one in comparison.numbers.items()
        },
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _ends(ci: Interval) -> list[float | None]:
    return [_finite(ci.low), _finite(ci.high)]
