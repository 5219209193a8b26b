"""A results folder, as the campaign's engine leaves it."""

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from fras_common.files import TEXT_BYTES, read_at_most
from fras_experiments.results.cells import Cells, read_cells
from fras_experiments.results.errors import BadResults, bad_cell
from fras_experiments.results.pulls import Pull, Series, pulls_of
from fras_experiments.results.trials import NEEDED, Trials, trials_of

CAMPAIGN: Final = "campaign.toml"
BASE: Final = "base.toml"
TRIALS: Final = "trials.csv"
TIMING: Final = "timing.csv"
SERIES: Final = "series"
TIMES: Final = ("wall_s", "cpu_s", "plan_first_s", "plan_median_s")
LATER_TIMES: Final = ("plan_service_s", "replan_move_s", "replan_release_s")
"""Tables of before have none of them."""


@dataclass(frozen=True)
class Timing:
    """What each trial cost; arrays of shape (n,), NaN where there is no value.

    Attributes
    ----------
    trial : str array
    wall_s, cpu_s : float array [s]
        Of the whole trial, all processes together.
    plan_first_s, plan_median_s : float array [s]
        Grounding and solving: of the first plan, and the median of all.
    plan_service_s : float array [s]
        Of the first plan through the planner, from SA's context to the plan.
    replan_move_s, replan_release_s : float array [s]
        The same of the first later plan that keeps the grasp, and of the first that releases it.
    """

    trial: NDArray[np.str_]
    wall_s: NDArray[np.float64]
    cpu_s: NDArray[np.float64]
    plan_first_s: NDArray[np.float64]
    plan_median_s: NDArray[np.float64]
    plan_service_s: NDArray[np.float64]
    replan_move_s: NDArray[np.float64]
    replan_release_s: NDArray[np.float64]

    def of(self, trials: Trials, name: str) -> NDArray[np.float64]:
        """Return a column in the order of the trials, NaN for one without a row, shape (n,)."""
        values = dict(zip(self.trial, getattr(self, name), strict=True))
        return np.array([values.get(one, np.nan) for one in trials.trial], dtype=np.float64)


@dataclass(frozen=True)
class Results:
    """A campaign's results.

    Attributes
    ----------
    folder : Path
    about, base : dict
        `campaign.toml` and `base.toml`, the campaign and its base scenario.
    trials : Trials
        Those that are a result of their scene.
    lost : Trials
        Those whose stack or worker died: they say nothing of the scene.
    timing : Timing or None
        None where the campaign has no `timing.csv`.
    pulls : tuple of Pull
        Of `trials`, in their order; empty where the campaign kept no series.
    """

    folder: Path
    about: dict[str, Any]
    base: dict[str, Any]
    trials: Trials
    lost: Trials
    timing: Timing | None
    pulls: tuple[Pull, ...]

    def settings(self, path: str, default: str) -> NDArray[np.str_]:
        """Return a scenario field of each trial, as text in TOML's spelling, shape (n,).

        Parameters
        ----------
        path : str
            Dotted, as `awareness.blocks`.
        default : str
            Where neither the sweep, nor the campaign, nor its base scenario sets it.
        """
        values = self.trials.swept.get(path, np.full(len(self.trials), "", dtype=np.str_))
        fixed = self.fixed(path)
        rest = default if fixed is None else _spelled(fixed)
        return np.where(values == "", rest, values)

    def fixed(self, path: str) -> object:
        """Return what the campaign, or else its base scenario, sets a field to; or None."""
        for table in (self.about.get("set"), self.base):
            value = _at(table, path)
            if value is not None:
                return value
        return None

    @property
    def stopped(self) -> NDArray[np.bool_]:
        """Whether a crossing of the soft limit stopped each trial's pulls."""
        return self.settings("awareness.no_limit", "false") != "true"


def read_results(folder: Path) -> Results:
    """Read a results folder whole.

    Raises
    ------
    BadResults
        It is none, or something in it is not as the engine writes it; with file, line and column.
    OSError
        A file can't be read.
    """
    if not folder.is_dir():
        raise BadResults(
            f"{folder}: no such folder; name the one that `fras experiment` wrote", path=folder
        )
    about = _toml(folder / CAMPAIGN)
    every = trials_of(read_cells(folder / TRIALS, NEEDED))
    trials, timing = every.where(~every.lost), folder / TIMING
    base = folder / BASE
    return Results(
        folder,
        about,
        _toml(base) if base.exists() else {},
        trials,
        every.where(every.lost),
        _timing(read_cells(timing, ("trial", *TIMES)), every) if timing.exists() else None,
        tuple(
            pull
            for trial in trials.trial
            for pull in _pulls(folder / SERIES / f"{trial}.csv", str(trial))
        ),
    )


def _toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(read_at_most(path, TEXT_BYTES).decode())
    except FileNotFoundError as error:
        raise BadResults(
            f"{path}: no such file; {path.parent} is no folder that `fras experiment` wrote",
            path=path,
        ) from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise BadResults(
            f"{path}: no TOML: {error}; the file was cut or changed", path=path
        ) from error


def _at(table: object, path: str) -> object:
    """Find a field in nested tables, or under its dotted path as one key."""
    if not isinstance(table, dict):
        return None
    fields = cast("dict[str, object]", table)
    if path in fields:
        return fields[path]
    head, _, rest = path.partition(".")
    return _at(fields.get(head), rest) if rest else None


def _spelled(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _timing(cells: Cells, trials: Trials) -> Timing:
    names = cells.texts("trial")
    for row in np.flatnonzero(~np.isin(names, trials.trial)):
        raise bad_cell(
            cells.path, cells.line_of(row), "trial", str(names[row]), f"a trial of {TRIALS}"
        )
    numbers = {name: _not_negative(cells, name) for name in TIMES}
    for name in LATER_TIMES:
        there = name in cells.names
        numbers[name] = _not_negative(cells, name) if there else np.full(len(names), np.nan)
    return Timing(names, **numbers)


def _not_negative(cells: Cells, name: str) -> NDArray[np.float64]:
    values = cells.numbers(name)
    for row in np.flatnonzero(values < 0.0):
        raise bad_cell(cells.path, cells.line_of(row), name, f"{values[row]:g}", "zero or more")
    return values


def _pulls(path: Path, trial: str) -> tuple[Pull, ...]:
    """Read the pulls of a trial; none where it has no series, as one that never pulled."""
    if not path.exists() or _only_header(path):
        return ()
    cells = read_cells(path, ("tick", "height_m", "force_n", "visibility"))

    def whole(name: str) -> NDArray[np.float64]:
        values = cells.numbers(name)
        for row in np.flatnonzero(np.isnan(values)):
            raise bad_cell(path, cells.line_of(row), name, "", "a finite number")
        return values

    tick = cells.integers("tick")
    back = np.flatnonzero(np.diff(tick) <= 0)
    if back.size:
        row = back[0] + 1
        raise bad_cell(path, cells.line_of(row), "tick", str(tick[row]), f"after {tick[row - 1]}")
    series = Series(tick, whole("height_m"), whole("force_n"), cells.numbers("visibility"))
    return pulls_of(trial, series)


def _only_header(path: Path) -> bool:
    with path.open(encoding="utf-8", errors="replace") as file:
        return bool(file.readline()) and not file.readline().strip()
