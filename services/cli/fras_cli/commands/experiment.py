"""`fras experiment`: its options; what it does stands in `fras_experiments.campaign`."""

import importlib
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from fras_cli.commands.shared import Mesh, console

experiment_app = typer.Typer()


class KeepLogs(StrEnum):
    """Of which trials the log is kept."""

    FAILED = "failed"
    ALL = "all"
    NONE = "none"


@experiment_app.command()
def experiment(
    name: Annotated[
        str | None,
        typer.Argument(help="A campaign's file, or one of ours (--list).", metavar="[NAME|FILE]"),
    ] = None,
    seeds: Annotated[
        str | None, typer.Option(help="Scenes, instead of the campaign's own.", metavar="A..B")
    ] = None,
    workers: Annotated[
        int, typer.Option(min=1, max=256, help="Stacks side by side on this machine.")
    ] = 1,
    scheduler: Annotated[
        str | None,
        typer.Option(help="A Dask cluster's workers instead.", metavar="tcp://HOST:PORT"),
    ] = None,
    mesh: Mesh = None,
    keep_logs: Annotated[KeepLogs, typer.Option(help="Of which trials.")] = KeepLogs.FAILED,
    again: Annotated[
        bool, typer.Option("--again", help="Run those that were aborted once more, too.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the results; what is there of the campaign is not run again.",
            show_default="runs/<stamp>-<name>",
        ),
    ] = None,
    show_list: Annotated[
        bool, typer.Option("--list", help="Show the campaigns that come with FRAS.")
    ] = False,
) -> None:
    """Run many trials whose scenes and fields vary; the same command goes on with --out."""
    from fras_common.extras import require_extra

    with require_extra("experiments"):
        command = importlib.import_module("fras_experiments.campaign.command")
    if show_list or name is None:
        raise typer.Exit(command.list_campaigns(console()))
    raise typer.Exit(
        command.experiment(
            name,
            seeds=seeds,
            workers=workers,
            scheduler=scheduler,
            mesh=mesh,
            keep=keep_logs.value,
            again=again,
            out=out,
        )
    )
