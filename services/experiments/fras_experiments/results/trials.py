"""A campaign's trials as columns, as `trials.csv` has them."""

from dataclasses import dataclass, fields, replace
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from fras_experiments.results.cells import Cells
from fras_experiments.results.errors import BadResults, bad_cell

Texts = NDArray[np.str_]
Numbers = NDArray[np.float64]

TEXTS: Final = ("trial", "scenario", "outcome", "reason", "grasp_block")
NUMBERS: Final = (
    *("visibility", "max_force_n", "soft_limit_n", "hard_limit_n", "crossings"),
    *("longest_above_ticks", "plans", "replans", "ticks"),
    *("grasp_x_m", "grasp_y_m", "roi_x_m", "roi_y_m", "lift_m"),
)
LATER: Final = ("patient_max_force_n", "missed_ticks")
"""Numbers that tables of before have not; none of their trials had a patient."""
NEEDED: Final = ("campaign", "seed", "scenario_kind", "complete", *TEXTS, *NUMBERS)
KNOWN: Final = frozenset(
    (*NEEDED, *LATER, "actions", "log", "patient_above_ticks", "needless_ticks")
)
"""Every other column is a swept field, by its dotted path."""
KINDS: Final = ("A", "B", "C")
SUCCESS: Final = "success"
PLANNED: Final = "planned"


@dataclass(frozen=True)
class Trials:
    """Trials of one campaign; every array has shape (n,), NaN where a trial has no value.

    Attributes
    ----------
    campaign : str
    swept : dict of str to Texts
        Swept fields by their dotted path, with their values as they stand in the table.
    kind : Texts
        A: pull; B: a later plan moves; C: a later plan releases; "" where no plan was done.
    complete : bool array
        Whether the trial's log is whole.
    visibility : Numbers
        Share at the end of the trial, 0 to 1.
    max_force_n, soft_limit_n, hard_limit_n : Numbers [N]
        The limits stand there also where nothing stopped at them (`awareness.no_limit`).
    crossings, longest_above_ticks : Numbers
        How often the soft limit was crossed, and for how many ticks at most.
    grasp_x_m, grasp_y_m, roi_x_m, roi_y_m, lift_m : Numbers [m]
        The last block grasped and the region of interest, at rest; the largest height of the tip
        above where the last pull began.
    patient_max_force_n : Numbers [N]
        What the patient bore; NaN for a trial without one, as `missed_ticks`.
    missed_ticks : Numbers
        Ticks in which the patient bore more than the soft limit and the model did not say so.
    """

    campaign: str
    swept: dict[str, Texts]
    seed: NDArray[np.int64]
    kind: Texts
    complete: NDArray[np.bool_]
    trial: Texts
    scenario: Texts
    outcome: Texts
    reason: Texts
    grasp_block: Texts
    visibility: Numbers
    max_force_n: Numbers
    soft_limit_n: Numbers
    hard_limit_n: Numbers
    crossings: Numbers
    longest_above_ticks: Numbers
    plans: Numbers
    replans: Numbers
    ticks: Numbers
    grasp_x_m: Numbers
    grasp_y_m: Numbers
    roi_x_m: Numbers
    roi_y_m: Numbers
    lift_m: Numbers
    patient_max_force_n: Numbers
    missed_ticks: Numbers

    def __len__(self) -> int:
        return len(self.trial)

    @property
    def success(self) -> NDArray[np.bool_]:
        """Whether each trial exposed the region of interest."""
        return self.outcome == SUCCESS

    @property
    def planned_only(self) -> bool:
        """Whether trials were to end with their first plan, so that nothing was retracted."""
        return bool((self.outcome == PLANNED).any())

    @property
    def crossed(self) -> NDArray[np.bool_]:
        """Whether each trial went above its soft limit; false where nobody counted."""
        return self.crossings > 0

    @property
    def lost(self) -> NDArray[np.bool_]:
        """Whether each trial's stack or worker died, which is no result of its scene."""
        return np.char.startswith(self.reason, "stack:") | np.char.startswith(
            self.reason, "worker:"
        )

    def where(self, chosen: NDArray[np.bool_]) -> Self:
        """Return the trials that are chosen, in the same order."""
        return self.taken(np.flatnonzero(chosen))

    def taken(self, rows: NDArray[np.int64]) -> Self:
        """Return the trials of these rows, in their order."""
        columns: dict[str, Any] = {
            one.name: getattr(self, one.name)[rows]
            for one in fields(self)
            if one.name not in {"campaign", "swept"}
        }
        swept = {name: values[rows] for name, values in self.swept.items()}
        return replace(self, swept=swept, **columns)


def trials_of(cells: Cells) -> Trials:
    """Make columns of a table.

    Raises
    ------
    BadResults
        A cell is not what its column holds, a trial stands there twice, or two campaigns are mixed.
    """
    campaigns = cells.texts("campaign")
    other = np.flatnonzero(campaigns != campaigns[0])
    if other.size:
        raise BadResults(
            f"{cells.path}, line {cells.line_of(other[0])}, column campaign: "
            f"{str(campaigns[other[0]])!r} beside {str(campaigns[0])!r}: "
            "two campaigns in one table",
            path=cells.path,
            line=cells.line_of(other[0]),
            column="campaign",
        )
    columns: dict[str, Any] = {name: cells.texts(name) for name in TEXTS}
    columns |= {name: cells.numbers(name) for name in NUMBERS}
    for name in LATER:
        there = name in cells.names
        columns[name] = cells.numbers(name) if there else np.full(len(cells.rows), np.nan)
    _check_once(cells, columns["trial"])
    visibility = cells.numbers("visibility")
    outside = np.flatnonzero((visibility < 0.0) | (visibility > 1.0))
    if outside.size:
        row = outside[0]
        raise bad_cell(
            cells.path, cells.line_of(row), "visibility", f"{visibility[row]:g}", "a share, 0 to 1"
        )
    kind = cells.texts("scenario_kind")
    for row in np.flatnonzero(~np.isin(kind, (*KINDS, ""))):
        raise bad_cell(cells.path, cells.line_of(row), "scenario_kind", str(kind[row]), "A, B or C")
    return Trials(
        campaign=str(campaigns[0]),
        swept={name: cells.texts(name) for name in cells.names if name not in KNOWN},
        seed=cells.integers("seed"),
        kind=kind,
        complete=cells.truths("complete"),
        **columns,
    )


def _check_once(cells: Cells, trial: Texts) -> None:
    first = dict[str, int]()
    for name, line in zip(trial, cells.lines, strict=True):
        if not str(name).isalnum():
            # It names a file, too.
            raise bad_cell(cells.path, line, "trial", str(name), "a number")
        before = first.setdefault(str(name), line)
        if before != line:
            raise BadResults(
                f"{cells.path}, lines {before} and {line}, column trial: {str(name)!r} twice",
                path=cells.path,
                line=line,
                column="trial",
            )
