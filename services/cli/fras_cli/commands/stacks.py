"""Commands that keep a stack of services, and look at it."""

from pathlib import Path
from typing import Annotated

import typer

from fras_cli.commands.shared import (
    AspDir,
    Cell,
    Compose,
    Connect,
    RouterPort,
    Secure,
    console,
    log_file,
)
from fras_common.signals import silent_interrupt

stacks_app = typer.Typer()
compose_app = typer.Typer(help="Other forms of a process table.", no_args_is_help=True)


@stacks_app.command()
@silent_interrupt()
def monitor(
    log: Annotated[
        Path | None,
        typer.Argument(
            help="An audit log, or a run's folder, to look at instead.", metavar="[LOG]"
        ),
    ] = None,
    cell: Annotated[
        str | None,
        typer.Option(help="Cell to watch, or to replay into.", show_default="local; replay"),
    ] = None,
    connect: Connect = None,
    host: Annotated[str, typer.Option(help="Where to listen.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="0: any free one.")] = 8080,
    token: Annotated[
        str, typer.Option(help="What a browser must show.", show_default="$FRAS_MONITOR_TOKEN")
    ] = "",
    view_token: Annotated[str, typer.Option(help="What one must show who may only look.")] = "",
    read_only: Annotated[
        bool, typer.Option("--read-only", help="Nobody may do more than look.")
    ] = False,
) -> None:
    """Serve the surgeon's page: of a running stack, or over a log."""
    from fras_cli.surgeons_page import page_of_log, page_of_stack
    from fras_cli.viewing import Page

    page = Page(host, port, token, view_token, read_only)
    if log is None:
        status = page_of_stack(cell or "local", connect, page)
    else:
        status = page_of_log(log_file(log), cell or "replay", page, console())
    raise typer.Exit(status)


@stacks_app.command()
@silent_interrupt()
def up(
    cell: Cell = "local",
    port: RouterPort = 7447,
    logs: Annotated[
        Path | None, typer.Option(help="Folder of the logs.", show_default="runs/up-<cell>/logs")
    ] = None,
    asp_dir: AspDir = None,
    compose: Compose = "local",
    secure: Secure = False,
    host: Annotated[
        str, typer.Option(help="Which host of the table this is: its processes alone.")
    ] = "",
    address: Annotated[
        list[str] | None,
        typer.Option(help="Where a host's router is, A=10.0.0.1[:PORT]; once a host."),
    ] = None,
) -> None:
    """Start the stack and keep it, for `fras run` and for clients of your own."""
    from fras_cli.keep import up
    from fras_cli.layout import layout_of
    from fras_supervisor.hosts import read_addresses

    folder = logs or Path("runs") / f"up-{cell}" / "logs"
    layout = layout_of(
        compose, asp_dir, secure=secure, host=host, addresses=read_addresses(address or [])
    )
    raise typer.Exit(up(cell, port, folder, console(), layout))


@stacks_app.command()
def down(cell: Cell = "local") -> None:
    """Stop the stack that `fras up` keeps."""
    from fras_cli.keep import down

    raise typer.Exit(down(cell, console()))


@stacks_app.command()
def status(
    cell: Cell = "local",
    connect: Connect = None,
    watch: Annotated[bool, typer.Option("--watch", help="Redraw it until Ctrl-C.")] = False,
) -> None:
    """Show the processes of a cell, what they use and do, and the task; 0 if all are ready."""
    from fras_cli.status import status

    raise typer.Exit(status(cell, connect, console(), watch=watch))


@stacks_app.command()
def restart(
    process: Annotated[
        str, typer.Argument(help="A process of the stack, as `fras status` has it.")
    ],
    cell: Cell = "local",
    connect: Connect = None,
) -> None:
    """Start a process of a running stack again, also one that was given up."""
    from fras_cli.restart import restart

    raise typer.Exit(restart(process, cell, connect, console()))


@stacks_app.command()
def logs(
    processes: Annotated[
        list[str] | None, typer.Argument(help="Whose; all without it.", metavar="[PROCESS]...")
    ] = None,
    lines: Annotated[int, typer.Option("-n", "--lines", min=0, help="Last lines of each.")] = 20,
    follow: Annotated[bool, typer.Option("--follow", "-f", help="Go on until Ctrl-C.")] = False,
    folder: Annotated[
        Path | None, typer.Option("--dir", help="Of a stack that has ended: the folder.")
    ] = None,
    cell: Cell = "local",
    connect: Connect = None,
) -> None:
    """Show what the processes of a stack on this machine have logged."""
    from fras_cli.service_logs import logs

    raise typer.Exit(logs(cell, connect, folder, processes or [], lines, follow))


@compose_app.command("docker")
def compose_docker(
    compose: Compose = "local",
    cell: Cell = "local",
    port: RouterPort = 7447,
    secure: Annotated[
        bool, typer.Option("--secure", help="With certificates, each container its own.")
    ] = False,
) -> None:
    """Print a process table as a Docker Compose file, a container a process."""
    from fras_cli.layout import Layout
    from fras_common.extras import require_extra

    with require_extra("supervisor"):
        from fras_supervisor.docker import compose_file
    table = Layout(compose, keys=Path("keys") if secure else None).table()
    print(compose_file(table, cell, port, secure=secure), end="")
