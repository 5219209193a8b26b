"""`fras experiment`: its options; what it does stands in `fras_experiments.campaign`."""

import importlib
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from fras_cli.commands.results import results_app
from fras_cli.commands.shared import AspDir, Mesh, console


class CampaignOrCommand(TyperGroup):
    """`fras experiment NAME` beside `fras experiment report DIR`.

    What is no command of the group is the campaign that `run` shall run.
    """

    RUN = "run"

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put `run` before arguments that name no command."""
        known = {*self.commands, *ctx.help_option_names}
        if args and args[0] not in known:
            args = [self.RUN, *args]
        return super().parse_args(ctx, args)


experiment_app = typer.Typer(
    cls=CampaignOrCommand, help="Campaigns of trials: run, report, compare.", no_args_is_help=True
)
experiment_app.add_typer(results_app)


class KeepLogs(StrEnum):
    """Of which trials the log is kept."""

    FAILED = "failed"
    ALL = "all"
    NONE = "none"


@experiment_app.command(CampaignOrCommand.RUN)
def run(
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
    asp_dir: AspDir = None,
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
    """Run many trials whose scenes and fields vary; the same command goes on with --out.

    `run` may be left out: `fras experiment retraction`.
    """
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
            asp_dir=asp_dir,
            keep=keep_logs.value,
            again=again,
            out=out,
        )
    )
