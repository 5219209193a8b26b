"""Numbers as a reader sees them: units, as many digits as are sure, a dash where there is none."""

import math
from collections.abc import Iterator, Sequence

from fras_experiments.results.statistics import Interval, Share

NONE = "–"


def number(value: float, digits: int = 2) -> str:
    """Return a number with so many digits behind the point."""
    return f"{value:.{digits}f}" if math.isfinite(value) else NONE


def percent(value: float, digits: int = 1) -> str:
    """Return a share in per cent, without the sign."""
    return number(100.0 * value, digits)


def interval(ci: Interval, digits: int = 2, scale: float = 1.0) -> str:
    """Return an interval in brackets, or nothing where it is unknown."""
    if not (math.isfinite(ci.low) and math.isfinite(ci.high)):
        return ""
    return f"[{number(scale * ci.low, digits)}, {number(scale * ci.high, digits)}]"


def share(value: Share) -> str:
    """Return a count, its share in per cent and its interval."""
    if not value.n:
        return NONE
    return f"{value.count} of {value.n}, {percent(value.value)} % {interval(value.ci, 1, 100.0)}"


def probability(p: float) -> str:
    """Return a p-value; small ones as a bound."""
    if math.isnan(p):
        return NONE
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Write a Markdown table, numbers to the right."""
    yield "| " + " | ".join(header) + " |"
    yield "|---" + "|---:" * (len(header) - 1) + "|"
    for row in rows:
        yield "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |"
    yield ""
