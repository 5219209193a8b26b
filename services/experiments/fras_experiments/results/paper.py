"""The paper's numbers, to stand beside ours.

Meli, Tagliabue et al., Autonomous tissue retraction with a biomechanically informed logic based
framework (2021), section IV. They are context and no goal: nothing is tuned to them.
"""

from dataclasses import dataclass
from typing import Final

BLOCKS: Final = 7
"""N of the N x N candidate grasping points, section IV-A."""
SIMULATIONS: Final = 100
"""Of scenarios A and B together, again of C, and again without limit; section IV-A."""


@dataclass(frozen=True)
class Stated:
    """A mean with its standard deviation, and of how many.

    Attributes
    ----------
    sd : float or None
        None where the paper gives none.
    highest : float or None
    """

    mean: float
    sd: float | None
    n: int
    highest: float | None = None


VISIBILITY: Final = Stated(0.9689, 0.0637, 2 * SIMULATIONS)
"""Reached over scenarios A, B and C. That n is 200 is our reading: 100 of A and B, 100 of C."""
VISIBILITY_REPLANNED: Final = Stated(0.9641, None, 36 + 46)
"""Where re-planning was needed, in scenarios B and C."""
FORCE_NO_LIMIT_N: Final = Stated(1.25, 0.96, SIMULATIONS, 8.50)
"""Largest force where no limit is set [N]."""
REPLANNED_B: Final = 36
"""Of 100: the limit was crossed and the tissue moved to the side."""
REPLANNED_C: Final = 46
"""Of 100, attachment points ignored in the first grasp: released and grasped anew."""

F_PERCENT: Final = (10, 30, 50, 70)


def _stated(n: int, *cells: tuple[float, float]) -> tuple[Stated, ...]:
    return tuple(Stated(mean, sd, n) for mean, sd in cells)


PLAN_S: Final[dict[int, tuple[Stated, ...]]] = {
    5: _stated(25, (0.25, 0.02), (0.24, 0.02), (0.23, 0.01), (0.24, 0.01)),
    6: _stated(25, (0.68, 0.02), (0.65, 0.02), (0.63, 0.01), (0.62, 0.01)),
    7: _stated(25, (1.50, 0.02), (1.48, 0.03), (1.41, 0.02), (1.42, 0.01)),
    8: _stated(25, (3.06, 0.04), (2.97, 0.06), (2.90, 0.04), (2.88, 0.02)),
    9: _stated(25, (5.88, 0.08), (5.70, 0.15), (5.51, 0.03), (5.51, 0.05)),
    10: _stated(25, (10.75, 0.20), (10.21, 0.28), (9.92, 0.09), (9.87, 0.08)),
}  # fmt: skip
"""Table I: first planning time by N, one entry for each of `F_PERCENT` [s]."""
REPLAN_B_S: Final[dict[int, Stated]] = {
    5: Stated(0.12, 0.04, 100),
    6: Stated(0.32, 0.09, 100),
    7: Stated(0.72, 0.19, 100),
    8: Stated(1.52, 0.49, 100),
    9: Stated(2.77, 0.60, 100),
    10: Stated(4.95, 1.05, 100),
}
"""Table I: re-planning in scenario B at f = 50 % [s]."""
REPLAN_C_S: Final[dict[int, Stated]] = {
    5: Stated(0.32, 0.02, 100),
    6: Stated(1.01, 0.10, 100),
    7: Stated(1.95, 0.04, 100),
    8: Stated(4.03, 0.08, 100),
    9: Stated(7.74, 0.16, 100),
    10: Stated(16.00, 1.43, 100),
}
"""Table I: re-planning in scenario C at f = 50 % [s]."""


def plan_at(blocks: int, fraction: float) -> Stated | None:
    """Return the first planning time at N and f [s]; None where Table I has no such cell."""
    at = [i for i, percent in enumerate(F_PERCENT) if abs(percent - 100.0 * fraction) < 1e-6]
    row = PLAN_S.get(blocks)
    return row[at[0]] if row and at else None


def plan_s(blocks: int) -> float | None:
    """Mean first planning time over all f [s]; None for an N that is not in Table I."""
    row = PLAN_S.get(blocks)
    return sum(cell.mean for cell in row) / len(row) if row else None
