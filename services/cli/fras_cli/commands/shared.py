"""Options and helpers that several commands share."""

from pathlib import Path
from typing import Annotated, Any, Final

import typer
from rich.console import Console

Cell = Annotated[str, typer.Option(help="Cell: stacks of different cells don't hear each other.")]
AspDir = Annotated[Path | None, typer.Option(help="Rules of your own, laid out like asp/.")]
Compose = Annotated[
    str, typer.Option(help="Processes of an own stack: local, crtk, or a file like theirs.")
]
Connect = Annotated[
    str | None,
    typer.Option(help="Endpoint of a router whose stack to use, tcp/HOST:PORT or tls/HOST:PORT."),
]
Secure = Annotated[
    bool,
    typer.Option("--secure", help="With certificates, made if there are none: docs/security.md."),
]

LogPath = Annotated[Path, typer.Argument(help="An audit log, or a run's folder.")]
Mesh = Annotated[str | None, typer.Option(help="Node counts of the tissue.", metavar="NX,NY,NZ")]
PlanId = Annotated[
    str, typer.Option(help="Only this one, by its id.", show_default="the one that waits")
]
RouterPort = Annotated[int, typer.Option(help="Port of the router.")]


def _shipped_names(incomplete: str) -> list[str]:
    """Complete the name of a scenario of ours; a shell completes files by itself."""
    from fras_common.shipped import shipped

    names = sorted(path.stem for path in (shipped("compose") / "scenarios").glob("*.toml"))
    return [name for name in names if name.startswith(incomplete)]


ScenarioName = Annotated[
    str,
    typer.Argument(
        help="A scenario file, or of ours: default, a, b, c, slab, twin.",
        autocompletion=_shipped_names,
    ),
]
SERVICE_ARGUMENTS: Final[dict[str, Any]] = {
    "allow_extra_args": True,
    "ignore_unknown_options": True,
}
"""Of a command whose arguments are another program's."""


def log_file(log: Path) -> Path:
    """Return the log that a run's folder holds, or the file that was named."""
    return log / "audit.mcap" if log.is_dir() else log


def console(as_json: bool = False) -> Console:
    """Return where a command speaks: not where its JSON goes."""
    return Console(stderr=as_json)
