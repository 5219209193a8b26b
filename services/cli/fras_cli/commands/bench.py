"""The command that measures."""

from typing import Annotated

import typer

from fras_cli.commands.shared import SERVICE_ARGUMENTS, console

bench_app = typer.Typer()


@bench_app.command(context_settings=SERVICE_ARGUMENTS)
def bench(
    context: typer.Context,
    name: Annotated[
        str | None, typer.Argument(help="Which; without it, the list.", metavar="[NAME]")
    ] = None,
) -> None:
    """Measure: `fras bench NAME`, with that benchmark's own options behind."""
    from fras_cli.bench import list_benchmarks, run_benchmark

    if name is None:
        list_benchmarks(console())
    else:
        raise typer.Exit(run_benchmark(name, context.args))
