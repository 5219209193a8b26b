"""Commands that make and check scenario files."""

from pathlib import Path
from typing import Annotated

import typer

from fras_cli.commands.shared import console

scenario_app = typer.Typer(help="Make and check scenario files.", no_args_is_help=True)


@scenario_app.command("new")
def scenario_new(
    seed: Annotated[int, typer.Option(help="Seed of the scene.")],
    out: Annotated[
        Path | None, typer.Option(help="File to write.", show_default="standard output")
    ] = None,
    base: Annotated[str, typer.Option(help="Scenario whose other fields to take.")] = "default",
) -> None:
    """Draw a scene from a seed and write it as a scenario file of its own."""
    from fras_cli.options import write_new_scenario

    write_new_scenario(base, seed, out)


@scenario_app.command("check")
def scenario_check(
    scenario: Annotated[str, typer.Argument(help="A scenario file.")],
) -> None:
    """Check a scenario file without running it."""
    from fras_cli.options import build_scenario

    checked = build_scenario(scenario)
    tissue = checked.tissue
    mesh = tissue.mesh_file or f"{tissue.node_counts} nodes"
    console().print(f"{scenario}: fine; seed {checked.seed}, {mesh}")
