"""`fras keys`: make, renew and look at the certificates of the security profile."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape

keys_app = typer.Typer(
    help="Make and renew the certificates by which services know each other.", no_args_is_help=True
)

Folder = Annotated[
    Path | None,
    typer.Option("--dir", help="Folder.", show_default="$FRAS_KEYS, or ~/.local/share/fras/keys"),
]
Days = Annotated[int, typer.Option(min=1, max=3650, help="How long the certificates are valid.")]
Hosts = Annotated[
    list[str] | None,
    typer.Option(
        "--host", help="Name or address of the router's machine; may be given again. Loopback: too."
    ),
]
DAYS = 365


def folder_of(given: Path | None) -> Path:
    """Return the folder given, or where keys are."""
    from fras_common.identity import default_keys_dir

    return given or default_keys_dir()


def hosts_of(given: list[str] | None) -> tuple[str, ...]:
    """Return the router's hosts, the loopback among them."""
    from fras_cli.keys.authority import HOSTS

    return tuple(dict.fromkeys((*HOSTS, *(given or ()))))


@keys_app.command("init")
def init(folder: Folder = None, days: Days = DAYS, host: Hosts = None) -> None:
    """Make a CA, and a key and a certificate for each service."""
    from fras_cli.keys import init_keys

    place = folder_of(folder)
    names = init_keys(place, datetime.now(UTC), days, hosts_of(host))
    _say(f"{escape(str(place))}: a CA and certificates of {', '.join(names)}")
    _say("keep ca.key to yourself: who has it can make any of them")


@keys_app.command("issue")
def issue(
    names: Annotated[list[str], typer.Argument(help="Services, as in `fras keys show`.")],
    folder: Folder = None,
    days: Days = DAYS,
    host: Hosts = None,
) -> None:
    """Make the certificate of a service that has none in this folder."""
    from fras_cli.keys import issue_keys

    place = folder_of(folder)
    issue_keys(place, names, datetime.now(UTC), days, hosts_of(host))
    _say(f"{escape(str(place))}: certificates of {', '.join(names)}")


@keys_app.command("rotate")
def rotate(
    names: Annotated[
        list[str] | None, typer.Argument(help="Whose; all without it.", metavar="[NAME]...")
    ] = None,
    folder: Folder = None,
    days: Days = DAYS,
    host: Hosts = None,
    new_ca: Annotated[
        bool, typer.Option("--new-ca", help="A new CA, too: the old certificates count no more.")
    ] = False,
) -> None:
    """Make certificates anew; the old ones, kept in old/, are good until they expire."""
    from fras_cli.keys import rotate_keys

    place, now = folder_of(folder), datetime.now(UTC)
    hosts = hosts_of(host)
    kept = rotate_keys(place, now, days, hosts, names or (), new_authority=new_ca)
    _say(f"{escape(str(place))}: renewed; the old ones are in {escape(str(kept))}")


@keys_app.command("revoke")
def revoke(
    names: Annotated[list[str], typer.Argument(help="Whose key somebody else may have.")],
    folder: Folder = None,
    days: Days = DAYS,
) -> None:
    """End what the certificates of a service so far may do, here and now; 3 if a stack stays."""
    from fras_cli.keys_revoke import revoke as revoke_now

    raise typer.Exit(revoke_now(folder_of(folder), names, days, Console()))


@keys_app.command("export")
def export(
    host: Annotated[str, typer.Argument(help="A host of the table.")],
    compose: Annotated[
        str, typer.Option(help="Table of several hosts: two-hosts, or a file like it.")
    ] = "two-hosts",
    out: Annotated[
        Path | None, typer.Option(help="Folder to make.", show_default="keys-HOST")
    ] = None,
    also: Annotated[
        list[str] | None,
        typer.Option(
            "--with", help="One more, as cli for `fras status` there; may be given again."
        ),
    ] = None,
    folder: Folder = None,
) -> None:
    """Put what a host needs in a folder: its services' certificates and keys, no others."""
    from fras_cli.keys import export_keys, is_router, issue_keys, look_at_keys
    from fras_cli.layout import Layout

    place, now = folder_of(folder), datetime.now(UTC)
    needed = [*Layout(compose, keys=place).certificates_of(host), *(also or [])]
    known = {one.name for one in look_at_keys(place, now)}
    issue_keys(place, [name for name in needed if is_router(name) and name not in known], now)
    made = out or Path(f"keys-{host}")
    names = export_keys(place, [*dict.fromkeys(needed)], made, now)
    _say(f"{escape(str(made))}: certificates and keys of {', '.join(names)}, and ca.pem")
    _say(f"copy it to host {host} over a channel you trust, and set FRAS_KEYS to it there")


@keys_app.command("show")
def show(folder: Folder = None) -> None:
    """List the certificates and until when they are valid; 1 if one of them can't be used."""
    from rich.table import Table

    from fras_cli.keys import look_at_keys

    place = folder_of(folder)
    standings = look_at_keys(place, datetime.now(UTC))
    table = Table("certificate", "valid until", "problem")
    for one in standings:
        until = f"{one.until:%Y-%m-%d %H:%M} UTC" if one.until is not None else "-"
        table.add_row(one.name, until, escape(one.problem))
    _say(f"{escape(str(place))}: {len(standings)} certificates")
    if standings:
        Console().print(table)
    raise typer.Exit(0 if standings and not any(one.problem for one in standings) else 1)


def _say(text: str) -> None:
    Console().print(text, soft_wrap=True, highlight=False)
