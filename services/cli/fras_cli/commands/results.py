"""`fras experiment report` and `compare`: options; `fras_experiments.results` does it."""

import importlib
from pathlib import Path
from types import ModuleType
from typing import Annotated

import typer

results_app = typer.Typer()

Where = Annotated[
    list[str] | None,
    typer.Option(
        help="Only trials at this point of the sweep; may be given again.", metavar="FIELD=VALUE"
    ),
]
Seed = Annotated[int, typer.Option(min=0, help="Of the bootstraps.")]


@results_app.command()
def report(
    folder: Annotated[Path, typer.Argument(help="A campaign's results.")],
    figure: Annotated[
        list[str] | None,
        typer.Option(
            help="Only this figure, and no summary: distributions, force, grasps, limit, planning."
        ),
    ] = None,
    format: Annotated[str, typer.Option(help="Of the figures: png, svg, pdf.")] = "png",
    seed: Seed = 0,
) -> None:
    """Write summary.md and the figures of a campaign anew, from what it stored."""
    raise typer.Exit(_command().report(folder, names=figure or (), kind=format, seed=seed))


@results_app.command()
def compare(
    a: Annotated[Path, typer.Argument(help="A campaign's results.")],
    b: Annotated[Path, typer.Argument(help="Others, over the same seeds; may be the same folder.")],
    where: Where = None,
    where_a: Where = None,
    where_b: Where = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON on standard output.")] = False,
    out: Annotated[Path | None, typer.Option(help="A figure to write: .png, .svg or .pdf.")] = None,
    seed: Seed = 0,
) -> None:
    """Compare two campaigns pair by pair: how large the change is, and whether chance makes it."""
    both = where or []
    raise typer.Exit(
        _command().compare_campaigns(
            a,
            b,
            where_first=[*both, *(where_a or [])],
            where_second=[*both, *(where_b or [])],
            as_json=json,
            out=out,
            seed=seed,
        )
    )


def _command() -> ModuleType:
    from fras_common.extras import require_extra

    with require_extra("experiments"):
        return importlib.import_module("fras_experiments.results.command")
