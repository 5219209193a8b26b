"""`fras experiment`, behind its options."""

import shutil
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Literal

from rich.console import Console
from rich.markup import escape

from fras_cli.options import COMMAND_LINE, parse_seeds
from fras_cli.run import EXIT_INTERRUPTED, EXIT_OK, caught_interrupts, default_out
from fras_common.scenario import ScenarioError
from fras_experiments.campaign.cluster import connected
from fras_experiments.campaign.code import code_version
from fras_experiments.campaign.progress import Pace, shown
from fras_experiments.campaign.reading import (
    FAULTS,
    Prepared,
    prepare,
    read_campaign,
    shipped,
)
from fras_experiments.campaign.records import Record
from fras_experiments.campaign.rounds import Round
from fras_experiments.campaign.spec import TrialSpec
from fras_experiments.campaign.store import Found, Store, opened

FAULTS_ABOUT = "trials with faults drawn from a seed, and what must hold all the same: fras chaos"
Keep = Literal["failed", "all", "none"]


def list_campaigns(console: Console) -> int:
    """Print the campaigns that come with FRAS."""
    told = {name: read_campaign(path).about for name, path in shipped().items()}
    for name, about in (told | {FAULTS: FAULTS_ABOUT}).items():
        console.print(f"{name:14}{about}", highlight=False)
    return EXIT_OK


def experiment(
    name: str,
    *,
    seeds: str | None,
    workers: int,
    scheduler: str | None,
    mesh: str | None,
    asp_dir: Path | None,
    keep: Keep,
    again: bool,
    out: Path | None,
) -> int:
    """Run a campaign, or what is left of it.

    Returns
    -------
    int
        0 once every trial has a result, 130 if interrupted; of `faults` that of `fras chaos`.

    Raises
    ------
    BadCampaign, ScenarioError, UnusableRules, FolderInUse, StoreUnwritable
    DeadScheduler, NoWorker, WorkerUnable
    """
    if name == FAULTS:
        if asp_dir is not None:
            problem = f"{FAULTS} tries the rules supplied"
            raise ScenarioError(COMMAND_LINE, "--asp-dir", str(asp_dir), problem)
        return _faults(seeds, workers, scheduler, mesh, out)
    console = Console()
    prepared = prepare(name, seeds=seeds, mesh=mesh, asp_dir=asp_dir)
    folder = (out or default_out(prepared.campaign.name)).resolve()
    with opened(folder, prepared, code_version()) as store, caught_interrupts() as interrupts:
        found = store.load()
        kept = {
            number: one
            for number, one in found.records.items()
            if not (again and one.result.outcome == "aborted")
        }
        _tell_begin(console, prepared, folder, found, len(kept))
        records = dict(kept)
        try:
            if len(kept) < len(prepared.trials):
                _run(
                    console, prepared, store, records, workers, scheduler, keep,
                    lambda: interrupts.count > 0,
                )  # fmt: skip
        finally:
            store.write_tables(records)
    _tell_end(console, folder, prepared, records, code_version())
    return EXIT_INTERRUPTED if interrupts.count else EXIT_OK


def _run(
    console: Console,
    prepared: Prepared,
    store: Store,
    records: dict[int, Record],
    workers: int,
    scheduler: str | None,
    keep: Keep,
    stop: Callable[[], bool],
) -> None:
    """Run what is left; each trial comes to `records` as it is kept."""
    left = {one.number: one for one in prepared.trials if one.number not in records}
    workers = min(workers, len(left))
    scratch = store.folder / "scratch"
    # What a command that was killed has left.
    shutil.rmtree(scratch, ignore_errors=True)
    try:
        with connected(workers, scheduler, scratch, stop) as cluster:
            count = cluster.workers()
            text = f"to run: {len(left)}; workers: {count}"
            console.print(f"{text}; {cluster.dashboard()}", style="dim", soft_wrap=True)
            with shown(console, Pace(len(prepared.trials), records)) as tell:

                def keep_and_tell(one: TrialSpec, record: Record) -> None:
                    records[one.number] = record
                    tell(one, record)

                Round(store, prepared, keep, stop, keep_and_tell).run(cluster, left)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _tell_begin(
    console: Console, prepared: Prepared, folder: Path, found: Found, kept: int
) -> None:
    total = len(prepared.trials)
    console.print(
        escape(f"campaign {prepared.campaign.name}: {total} trials, results in {folder}"),
        soft_wrap=True,
    )
    said = [f"{kept} of them are there already"] if kept else []
    if found.spoilt:
        said.append(f"{found.spoilt} can't be read, and are run again")
    if found.foreign:
        said.append(f"{found.foreign} records of another build are left aside")
    if said:
        console.print("; ".join(said), style="dim")


def _tell_end(
    console: Console,
    folder: Path,
    prepared: Prepared,
    records: Mapping[int, Record],
    code: str,
) -> None:
    counts = Counter(one.result.outcome for one in records.values())
    told = ", ".join(f"{count} {outcome}" for outcome, count in counts.most_common())
    total = len(prepared.trials)
    console.print(f"{len(records)} of {total} trials: {told or 'none'}", highlight=False)
    if others := sum(one.code != code for one in records.values()):
        text = f"{others} ran on another processor or other libraries: last digits may differ"
        console.print(text, style="yellow")
    if len(records) < total:
        text = f"the same command with --out {folder} goes on"
        console.print(escape(text), style="yellow", soft_wrap=True)
    console.print(
        escape(f"{folder / 'trials.csv'}, timing.csv, series/"), style="dim", soft_wrap=True
    )


def _faults(
    seeds: str | None, workers: int, scheduler: str | None, mesh: str | None, out: Path | None
) -> int:
    """Run the chaos campaign over scenario a: its trials' faults are drawn from the first seed."""
    from fras_experiments.chaos.command import chaos
    from fras_experiments.chaos.faults import KINDS

    if scheduler is not None:
        raise ScenarioError(
            COMMAND_LINE, "--scheduler", scheduler, f"{FAULTS} runs on this machine: use --workers"
        )
    drawn = parse_seeds(seeds or "0..99")
    return chaos(
        "a",
        trials=len(drawn),
        only=None,
        seed=drawn.start,
        faults=",".join(KINDS),
        workers=workers,
        mesh=mesh,
        pace=0.0,
        audit=False,
        as_json=False,
        out=out,
    )
