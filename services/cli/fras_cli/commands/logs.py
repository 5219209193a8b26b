"""Commands that read audit logs."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from fras_cli.commands.shared import LogPath, console, log_file

logs_app = typer.Typer()
log_app = typer.Typer(help="Look into audit logs.", no_args_is_help=True)


@logs_app.command()
def report(
    log: LogPath,
    out: Annotated[
        Path | None, typer.Option(help="Where to write.", show_default="beside the log")
    ] = None,
) -> None:
    """Write summary.json and report.html from an audit log alone."""
    from fras_cli.display import print_summary
    from fras_cli.report import write_report

    path = log_file(log)
    folder = out or path.parent
    summary = write_report(path, folder)
    print_summary(console(), summary, [("report", str(folder / "report.html"))])


@logs_app.command()
def audit(
    log: LogPath,
    only: Annotated[
        str | None,
        typer.Option(help="Some services: sa, planner, motion, sim.", metavar="SERVICE,..."),
    ] = None,
    asp_dir: Annotated[
        Path | None,
        typer.Option(help="Instead: what would these rules, laid out like asp/, have decided?"),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Derive every decision and state of a log again, and compare; 0 only if all are equal."""
    from fras_common.threads import one_thread

    # As in the services, before any numerical library: sums in their order, to the last bit.
    one_thread()
    from fras_cli.audit import audit, other_rules

    path = log_file(log)
    if asp_dir is not None:
        status = other_rules(path, asp_dir, as_json=json, console=Console())
    else:
        status = audit(path, only, as_json=json, console=Console())
    raise typer.Exit(status)


@logs_app.command()
def replay(
    log: LogPath,
    cell: Annotated[
        str, typer.Option(help="Cell to replay into; no service may be there.")
    ] = "replay",
    connect: Annotated[
        str | None,
        typer.Option(help="Endpoint of a router, tcp/HOST:PORT.", show_default="an own one"),
    ] = None,
    rate: Annotated[float, typer.Option(help="Seconds of the log a second, 0.1 to 100.")] = 1.0,
    fast: Annotated[
        bool, typer.Option("--as-fast-as-possible", help="As fast as messages go out.")
    ] = False,
    loop: Annotated[bool, typer.Option("--loop", help="Begin anew at the end.")] = False,
    paused: Annotated[bool, typer.Option("--paused", help="Stand still at the start.")] = False,
    stay: Annotated[
        bool, typer.Option("--stay", help="Stay at the end until told to stop.")
    ] = False,
    first: Annotated[
        str | None,
        typer.Option("--from", help="Where to begin: a tick, or seconds.", metavar="TICK|2.5s"),
    ] = None,
    last: Annotated[
        str | None,
        typer.Option("--to", help="Where to end, that tick included.", metavar="TICK|2.5s"),
    ] = None,
    include: Annotated[
        list[str] | None,
        typer.Option(help="Replay this key or family (sim/**) only; may be given again."),
    ] = None,
    exclude: Annotated[
        list[str] | None, typer.Option(help="Leave this key or family out; may be given again.")
    ] = None,
    remap: Annotated[
        list[str] | None,
        typer.Option(help="Send a key, or family, under another name.", metavar="OLD=NEW"),
    ] = None,
) -> None:
    """Play a log back onto the bus: keys in the terminal or queries control it, as it runs."""
    from fras_cli.replay import UNLIMITED, Wanted
    from fras_cli.replay import replay as replay_log

    wanted = Wanted(
        cell,
        connect,
        rate=UNLIMITED if fast else rate,
        loop=loop,
        paused=paused,
        stay=stay,
        first=first,
        last=last,
        include=include or (),
        exclude=exclude or (),
        remap=remap or (),
    )
    raise typer.Exit(replay_log(log_file(log), wanted, console()))


@log_app.command("info")
def log_info(
    log: LogPath,
    json: Annotated[bool, typer.Option("--json", help="Print it as JSON.")] = False,
) -> None:
    """List the keys of a log with counts and rates, how the trial ended, and what the log is."""
    from fras_cli.log_info import read_info
    from fras_cli.log_info_print import print_info, print_json

    info = read_info(log_file(log))
    if json:
        print_json(info)
    else:
        print_info(info, console())


@log_app.command("extract")
def log_extract(
    log: LogPath,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder to write them to; nothing there is written over.",
            show_default="list them",
        ),
    ] = None,
) -> None:
    """List the files attached to a log (rules, scenario, mesh), or write them out."""
    from fras_cli.log_extract import extract

    raise typer.Exit(extract(log_file(log), out, console()))


@log_app.command("verify")
def log_verify(
    log: LogPath,
    asp_dir: Annotated[
        Path | None,
        typer.Option(
            help="Specifications to take, laid out like asp/.", show_default="the log's own"
        ),
    ] = None,
    key: Annotated[
        list[Path] | None,
        typer.Option(help="Public key to trust instead of this machine's; may be given again."),
    ] = None,
    head: Annotated[
        str, typer.Option(help="Head of the chain, as noted when the log was closed.")
    ] = "",
) -> None:
    """Tell whether a log is what was recorded, and its trial kept to the safety specifications."""
    from fras_cli.log_verify import verify_log

    raise typer.Exit(verify_log(log_file(log), asp_dir, console(), keys=key or [], head=head))


@log_app.command("recover")
def log_recover(
    log: Annotated[Path, typer.Argument(help="A damaged audit log, or a run's folder.")],
    out: Annotated[
        Path | None, typer.Option(help="File to write.", show_default="LOG.recovered.mcap")
    ] = None,
) -> None:
    """Write what a damaged log still holds into a new one; the old one stays as it is."""
    from fras_cli.log_recover import recover_log

    raise typer.Exit(recover_log(log_file(log), out, console()))


@log_app.command("show")
def log_show(
    log: LogPath,
    key: Annotated[str, typer.Argument(help="One of the keys that `fras log info` lists.")],
    json: Annotated[bool, typer.Option("--json", help="JSON, one message a line.")] = False,
    first: Annotated[int | None, typer.Option("--from", help="First tick to show.")] = None,
    last: Annotated[int | None, typer.Option("--to", help="Last tick to show.")] = None,
) -> None:
    """Show the messages of one key."""
    from fras_cli.log_show import show_log

    show_log(log_file(log), key, console(json), as_json=json, first_tick=first, last_tick=last)


@log_app.command("export")
def log_export(
    log: LogPath,
    foxglove: Annotated[
        bool, typer.Option("--foxglove", help="Write an MCAP file for Foxglove and Lichtblick.")
    ] = False,
    rerun: Annotated[
        bool, typer.Option("--rerun", help="Write an .rrd file for Rerun; needs the extra `rerun`.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="File to write; with both formats, its name without the ending.",
            show_default="beside the log",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite what is there.")] = False,
    layout: Annotated[
        bool, typer.Option("--layout", help="Write a layout to import beside the Foxglove file.")
    ] = False,
) -> None:
    """Export a trial for viewers: scene, force and visibility, and the plans' reasons."""
    from fras_cli.log_export import export_log
    from fras_log.export import Format

    kinds = [Format.FOXGLOVE] * foxglove + [Format.RERUN] * rerun
    raise typer.Exit(export_log(log_file(log), kinds, out, force, layout, console()))
