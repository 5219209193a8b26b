"""`fras chaos`, behind its options."""

import sys
from pathlib import Path

import msgspec
from rich.console import Console

from fras_cli.options import COMMAND_LINE, build_trial
from fras_cli.run import (
    EXIT_INTERRUPTED,
    EXIT_NOT_SUCCESS,
    EXIT_OK,
    FolderInUse,
    caught_interrupts,
    default_out,
)
from fras_common.scenario import ScenarioError
from fras_experiments.chaos.campaign import RESULT, Asked, run
from fras_experiments.chaos.faults import KINDS, Kind
from fras_experiments.chaos.figure import save_recovery
from fras_experiments.chaos.report import print_campaign, print_trial, write_summary
from fras_experiments.chaos.results import TrialRecord


def parse_kinds(text: str) -> tuple[Kind, ...]:
    """Kinds of faults from `kill,pause`.

    Raises
    ------
    ScenarioError
        One of them is none, stands there twice, or there is none at all.
    """
    asked = [one.strip() for one in text.split(",")]
    known: tuple[Kind, ...] = tuple(kind for kind in KINDS if asked.count(kind))
    if len(known) != len(asked):
        raise ScenarioError(COMMAND_LINE, "--faults", text, f"some of {','.join(KINDS)}, each once")
    return known


def chaos(
    scenario: str,
    *,
    trials: int,
    only: int | None,
    seed: int,
    faults: str,
    workers: int,
    mesh: str | None,
    pace: float,
    audit: bool,
    as_json: bool,
    out: Path | None,
) -> int:
    """Run a campaign, and write what it found.

    Returns
    -------
    int
        0 if every invariant held in each trial, 1 if not, 130 if interrupted.
    """
    kinds = parse_kinds(faults)
    given = build_trial(scenario, pace=pace, mesh=mesh)
    folder = out or default_out(f"chaos-{seed}")
    if folder.exists() and any(folder.iterdir()):
        raise FolderInUse(f"{folder} is not empty: choose another --out", path=folder)
    folder.mkdir(parents=True, exist_ok=True)
    console = Console(stderr=as_json)
    numbers = range(trials) if only is None else [only]
    asked = Asked(scenario, given, seed, numbers, kinds, folder.resolve(), workers, audit)

    def tell(record: TrialRecord) -> None:
        print_trial(console, record)

    with caught_interrupts() as interrupts:
        console.print("starting the services; first a trial in which nothing happens", style="dim")
        campaign = run(asked, stop=lambda: interrupts.count > 0, tell=tell)
    write_summary(campaign, folder / "summary.md")
    save_recovery(campaign, folder / "recovery.png")
    print_campaign(console, campaign)
    console.print(f"{folder / RESULT}, summary.md, recovery.png", style="dim", soft_wrap=True)
    if as_json:
        sys.stdout.write(msgspec.json.encode(campaign).decode() + "\n")
    if interrupts.count:
        return EXIT_INTERRUPTED
    return EXIT_NOT_SUCCESS if campaign.broken or not campaign.trials else EXIT_OK
