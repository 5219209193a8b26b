"""`fras experiment report` and `fras experiment compare`, behind their options."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from fras_cli.run import EXIT_BAD_INPUT, EXIT_OK
from fras_common.files import write_whole
from fras_experiments.results.comparison import chosen, compare
from fras_experiments.results.comparison_told import as_plain, comparison_table, footnotes
from fras_experiments.results.errors import BadResults
from fras_experiments.results.figures import FIGURES
from fras_experiments.results.figures.comparison import draw_comparison
from fras_experiments.results.figures.style import FORMATS, save
from fras_experiments.results.reading import read_results
from fras_experiments.results.summary import summary_lines
from fras_experiments.results.trials import Trials

SUMMARY = "summary.md"
FOLDER = "figures"


def write_report(
    folder: Path, *, names: Sequence[str] = (), kind: str = "png", seed: int = 0
) -> tuple[Path, ...]:
    """Write `summary.md` and the figures of a results folder anew.

    Parameters
    ----------
    names : sequence of str
        Only these figures, and no summary; all and the summary if empty.
    kind : str
        One of `FORMATS`.
    seed : int
        Of the bootstraps, and of the points' sideways offsets.

    Returns
    -------
    tuple of Path
        What was written. A figure that the campaign has nothing for is not, and one of an earlier
        report is taken away.

    Raises
    ------
    BadResults
        The folder can't be read, or there is no such figure or format.
    OSError
        Something can't be written.
    """
    _check(names, kind)
    results = read_results(folder)
    written, shown = list[Path](), dict[str, str]()
    for name in names or FIGURES:
        figure, path = FIGURES[name].draw(results, seed), folder / FOLDER / f"{name}.{kind}"
        if figure is None:
            path.unlink(missing_ok=True)
            continue
        save(figure, path)
        written.append(path)
        shown[f"{FOLDER}/{path.name}"] = FIGURES[name].caption
    if not names:
        path = folder / SUMMARY
        text = "\n".join(summary_lines(results, shown, seed=seed)).rstrip() + "\n"
        write_whole(path, text.encode())
        written.append(path)
    return tuple(written)


def report(folder: Path, *, names: Sequence[str], kind: str, seed: int) -> int:
    """Write the report and tell what was written.

    Returns
    -------
    int
        0, or 2 if the folder can't be read.
    """
    try:
        written = write_report(folder, names=names, kind=kind, seed=seed)
    except BadResults as error:
        return _refused(error)
    console = Console()
    for path in written:
        console.print(str(path), soft_wrap=True, highlight=False, markup=False)
    return EXIT_OK


def compare_campaigns(
    first: Path,
    second: Path,
    *,
    where_first: Sequence[str],
    where_second: Sequence[str],
    as_json: bool,
    out: Path | None,
    seed: int,
) -> int:
    """Compare two campaigns and print the table.

    Parameters
    ----------
    where_first, where_second : sequence of str
        FIELD=VALUE: only the trials at this point of the sweep.

    Returns
    -------
    int
        0, or 2 if one can't be read or nothing can be paired.
    """
    try:
        if out is not None:
            _check((), out.suffix.removeprefix("."))
        ours, others = _trials(first, where_first), _trials(second, where_second)
        comparison = compare(ours, others, seed=seed)
    except BadResults as error:
        return _refused(error)
    names = _name(ours, where_first), _name(others, where_second)
    if names[0] == names[1]:
        # One campaign by other rules, or other code: only the folders tell which is which.
        names = f"{names[0]} in {first}", f"{names[1]} in {second}"
    if as_json:
        sys.stdout.write(json.dumps(as_plain(comparison, *names, seed), indent=2) + "\n")
    else:
        console = Console()
        console.print(comparison_table(comparison, *names))
        console.print(footnotes(comparison), style="dim", markup=False, highlight=False)
    if out is not None:
        save(draw_comparison(comparison, *names), out)
    return EXIT_OK


def _trials(folder: Path, where: Sequence[str]) -> Trials:
    conditions = dict[str, str]()
    for one in where:
        name, sign, value = one.partition("=")
        if not sign or not name:
            raise BadResults(f"{one!r} is no FIELD=VALUE, as planner.criterion=sum", given=one)
        conditions[name.strip()] = value.strip()
    return chosen(read_results(folder).trials, conditions)


def _name(trials: Trials, where: Sequence[str]) -> str:
    return " ".join([trials.campaign, *where])


def _check(names: Sequence[str], kind: str) -> None:
    for name in names:
        if name not in FIGURES:
            raise BadResults(f"no figure {name!r}: there are {', '.join(FIGURES)}", figure=name)
    if kind not in FORMATS:
        raise BadResults(f"no format {kind!r}: there are {', '.join(FORMATS)}", format=kind)


def _refused(error: BadResults) -> int:
    print(f"fras: {error}", file=sys.stderr)
    return EXIT_BAD_INPUT
