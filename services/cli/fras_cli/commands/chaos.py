"""`fras chaos`: its options; what it does stands in `fras_experiments.chaos`."""

import importlib
from pathlib import Path
from typing import Annotated

import typer

from fras_cli.commands.shared import Mesh, ScenarioName

chaos_app = typer.Typer()

ALL = "kill,pause,router,delay,disk,clock"


@chaos_app.command()
def chaos(
    scenario: ScenarioName = "a",
    trials: Annotated[int, typer.Option(min=1, max=10_000, help="How many.")] = 10,
    only: Annotated[
        int | None, typer.Option(min=0, help="Repeat this one trial of the seed, and no other.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Draws the faults of each trial.")] = 0,
    faults: Annotated[str, typer.Option(help="Which kinds may happen.")] = ALL,
    workers: Annotated[
        int, typer.Option(min=1, max=64, help="Stacks side by side; more slow each other down.")
    ] = 1,
    mesh: Mesh = None,
    pace: Annotated[
        float, typer.Option(help="Simulated seconds a second; 0: as fast as possible.")
    ] = 0.0,
    audit: Annotated[
        bool, typer.Option("--audit", help="Derive each decision again, too; takes its time.")
    ] = False,
    json: Annotated[
        bool, typer.Option("--json", help="Print the results as JSON on standard output.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="An empty folder.", show_default="runs/<stamp>-chaos-<seed>")
    ] = None,
) -> None:
    """Repeat a trial with faults drawn from a seed; 0 if everything held that must hold."""
    from fras_common.extras import require_extra

    with require_extra("experiments"):
        command = importlib.import_module("fras_experiments.chaos.command")
    raise typer.Exit(
        command.chaos(
            scenario,
            trials=trials,
            only=only,
            seed=seed,
            faults=faults,
            workers=workers,
            mesh=mesh,
            pace=pace,
            audit=audit,
            as_json=json,
            out=out,
        )
    )
