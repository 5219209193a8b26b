"""A campaign's table, on the screen and as `summary.md`."""

from collections.abc import Iterator
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from fras_experiments.chaos.results import Campaign, Row, TrialRecord, breaches_of, rows

COLUMNS = (
    *("fault", "times", "success", "held", "broken"),
    *("stalls", "p50 [s]", "p95 [s]", "max [s]"),
)


def print_trial(console: Console, record: TrialRecord) -> None:
    """Print one line a trial, as it ends."""
    faults = "; ".join(
        one.fault.in_words()
        + ("" if one.at_ns else " (not reached)")
        + (f" -> {one.recovery_s:.2f} s" if one.recovery_s is not None else "")
        for one in record.faults
    )
    mark = "[bold red]BROKEN[/] " if record.breaches else ""
    ending = record.outcome if record.outcome == "success" else f"{record.outcome} {record.reason}"
    console.print(
        f"{record.number:4d}  {mark}{escape(ending)}  [dim]{escape(faults)}[/]",
        soft_wrap=True,
        highlight=False,
    )
    for breach in record.breaches:
        console.print(f"      {escape(_told(breach.invariant, breach.text, breach.tick))}")


def print_campaign(console: Console, campaign: Campaign) -> None:
    """Print the table, and one sentence."""
    table = Table(*COLUMNS)
    for row in rows(campaign):
        table.add_row(*_cells(row), style="bold red" if row.broken else None)
    console.print(table)
    console.print(sentence(campaign))


def sentence(campaign: Campaign) -> str:
    """Tell the campaign in one sentence."""
    success = sum(one.outcome == "success" for one in campaign.trials)
    held = sum(one.reason.startswith("hold:") for one in campaign.trials)
    broken = len(campaign.broken)
    return (
        f"{len(campaign.trials)} of {campaign.asked} trials of scenario {campaign.scenario}, seed "
        f"{campaign.seed}: {success} success, {held} ended in a named hold; "
        + (f"in {broken} something did not hold" if broken else "every invariant held in each")
    )


def write_summary(campaign: Campaign, path: Path) -> None:
    """Write `summary.md`."""
    path.write_text("\n".join(_lines(campaign)) + "\n", encoding="utf-8")


def _lines(campaign: Campaign) -> Iterator[str]:
    yield f"{sentence(campaign)}."
    yield ""
    yield (
        f"{campaign.cores} cores, load {campaign.load[0]:.1f} when it began and "
        f"{campaign.load[1]:.1f} when it ended. Undisturbed: {campaign.undisturbed_ticks} ticks, "
        f"at most {campaign.undisturbed_force_n:.3f} N."
    )
    yield ""
    yield "| " + " | ".join(COLUMNS) + " |"
    yield "|---" + "|---:" * (len(COLUMNS) - 1) + "|"
    for row in rows(campaign):
        yield "| " + " | ".join(_cells(row)) + " |"
    yield ""
    for number, breach in breaches_of(campaign):
        yield f"- trial {number}: {_told(breach.invariant, breach.text, breach.tick)}"
    yield "| trial | faults | outcome | reason |"
    yield "|---:|---|---|---|"
    for trial in campaign.trials:
        faults = "; ".join(one.fault.in_words() for one in trial.faults)
        yield f"| {trial.number} | {faults} | {trial.outcome or '-'} | {trial.reason} |"


def _cells(row: Row) -> tuple[str, ...]:
    counts = (row.happened, row.success, row.held, row.broken, row.stalled)
    times = (row.p50_s, row.p95_s, row.max_s)
    shown = ("-" if time_s is None else f"{time_s:.2f}" for time_s in times)
    return (row.name, *map(str, counts), *shown)


def _told(invariant: str, text: str, tick: int) -> str:
    return f"{invariant}: {text}" + (f" (tick {tick})" if tick >= 0 else "")
