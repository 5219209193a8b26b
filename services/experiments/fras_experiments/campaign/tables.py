"""The tables of a campaign, as text: one row a trial, in the campaign's order."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import Final, cast

import msgspec

from fras_experiments.campaign.records import Lifted, Record, Result, Timing
from fras_experiments.campaign.spec import TrialSpec

RESULTS: Final = Result.__struct_fields__
TIMINGS: Final = Timing.__struct_fields__


def trials_csv(
    campaign: str,
    scenario: str,
    varied: Sequence[str],
    trials: Iterable[TrialSpec],
    records: Mapping[int, Record],
) -> str:
    """Write the trials that have a record; nothing in it depends on who ran them.

    Parameters
    ----------
    campaign, scenario : str
        Names of the campaign and of its base scenario.
    varied : sequence of str
        Paths of the fields that differ: each a column.
    records : mapping of int to Record
        By the number of the trial.
    """
    head = ["campaign", "trial", "scenario", "seed", *varied, *RESULTS, "log"]
    rows = [
        [
            campaign,
            one.number,
            scenario,
            one.scenario.seed,
            *(one.labels[path] for path in varied),
            *msgspec.structs.astuple(records[one.number].result),
            records[one.number].log,
        ]
        for one in trials
        if one.number in records
    ]
    return _csv(head, rows)


def timing_csv(trials: Iterable[TrialSpec], records: Mapping[int, Record]) -> str:
    """Write who ran the trials, and how long that took."""
    rows = [
        [one.number, *msgspec.structs.astuple(records[one.number].timing)]
        for one in trials
        if one.number in records
    ]
    return _csv(["trial", *TIMINGS], rows)


def series_csv(series: Iterable[Lifted]) -> str:
    """Write force and visibility against height."""
    rows = [list(msgspec.structs.astuple(one)) for one in series]
    return _csv(list(Lifted.__struct_fields__), rows)


def cell(value: object) -> str:
    """Return a value as it stands in a table: nine digits are more than any of it means."""
    match value:
        case None:
            return ""
        case bool():
            return "true" if value else "false"
        case float():
            return f"{value:.9g}"
        case list() | tuple():
            return "x".join(cell(item) for item in cast("Sequence[object]", value))
        case _:
            return str(value)


def _csv(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([cell(value) for value in row] for row in rows)
    return text.getvalue()
