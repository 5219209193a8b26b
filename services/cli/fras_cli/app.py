"""The `fras` command: its groups, put together, and what becomes of errors."""

import sys
from typing import Annotated

import typer

from fras_cli.commands.bench import bench_app
from fras_cli.commands.chaos import chaos_app
from fras_cli.commands.experiment import experiment_app
from fras_cli.commands.keys import keys_app
from fras_cli.commands.logs import log_app, logs_app
from fras_cli.commands.scenarios import scenario_app
from fras_cli.commands.services import services_app
from fras_cli.commands.stacks import compose_app, stacks_app
from fras_cli.commands.trials import trials_app
from fras_common.errors import FrasError

app = typer.Typer(
    name="fras",
    help="Autonomous tissue retraction: plan, watch, move, explain, record.",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
# Those without a name stand beside each other, as commands of `fras` itself.
for _group in (
    trials_app,
    stacks_app,
    logs_app,
    bench_app,
    chaos_app,
    services_app,
):
    app.add_typer(_group)
for _name, _named in {
    "experiment": experiment_app,
    "log": log_app,
    "scenario": scenario_app,
    "keys": keys_app,
    "compose": compose_app,
}.items():
    app.add_typer(_named, name=_name)


def _print_version(context: typer.Context, asked: bool) -> None:
    if asked:
        from fras_cli.version import print_version

        print_version(as_json=context.params["json"])
        raise typer.Exit


@app.callback()
def common(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=_print_version,
            help="Show the version, and what it was built from and runs on.",
        ),
    ] = False,
    # Eager, so that it is known when the version is printed.
    json: Annotated[
        bool, typer.Option("--json", is_eager=True, help="With --version: as JSON.")
    ] = False,
) -> None:
    """Autonomous tissue retraction: plan, watch, move, explain, record."""
    if json:
        raise typer.BadParameter("it goes with --version, or behind a command", param_hint="--json")


def main() -> None:
    """Run the command; a known error is one line and an exit status, not a traceback."""
    try:
        app()
    except FrasError as error:
        # Not at the top: it knows the errors of all commands, and so loads them all.
        from fras_cli.failures import exit_status

        print(f"fras: {error}", file=sys.stderr)
        sys.exit(exit_status(error))
    except OSError as error:
        from fras_cli.failures import EXIT_BAD_INPUT

        print(f"fras: {error.filename or 'a file'}: {error.strerror or error}", file=sys.stderr)
        sys.exit(EXIT_BAD_INPUT)
