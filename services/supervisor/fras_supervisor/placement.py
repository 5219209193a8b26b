"""What of a table one host runs, and where it finds the routers of the others. Pure."""

from collections.abc import Mapping
from string import Formatter

import msgspec

from fras_supervisor.errors import BadAddress, NoAddress, NothingOnHost, UnknownHost
from fras_supervisor.hosts import PORT, endpoint_at, placeholder, services_placeholder
from fras_supervisor.producers import service_of
from fras_supervisor.table import Process, Table

ROUTER, SUPERVISOR = "router", "supervisor"


def place(
    table: Table, host: str, port: int, addresses: Mapping[str, str], protocol: str = "tcp"
) -> tuple[Table, dict[str, str]]:
    """Take the processes of one host out of a table.

    Parameters
    ----------
    table : Table
    host : str
        Name of a host of the table.
    port : int
        On which its own router listens.
    addresses : mapping of str to str
        Of hosts, as `HOST` or `HOST:PORT`; they go before those of the table.
    protocol : str
        What the routers speak, `tcp` or `tls`.

    Returns
    -------
    Table
        Those processes, to be run here, and who runs elsewhere.
    dict of str to str
        What to fill in for the routers' endpoints, and the services of hosts, that the commands
        ask for.

    Raises
    ------
    UnknownHost
        A name that the table does not have.
    NothingOnHost
        No process of the table is this host's.
    NoAddress
        A command asks for a router whose address is not known.
    BadAddress
        An address is none.
    """
    for name in (host, *addresses):
        if name not in table.hosts:
            raise UnknownHost(table.source, name, tuple(table.hosts))
    here = {
        name: msgspec.structs.replace(process, host="localhost")
        for name, process in table.processes.items()
        if process.host == host
    }
    if not here:
        raise NothingOnHost(table.source, host)
    known = {**table.hosts, **addresses}
    routers = {
        placeholder(name): endpoint_at(address, port if name == host else PORT, protocol)
        for name, address in known.items()
        if address
    }
    for name, endpoint in routers.items():
        if protocol == "tls" and not endpoint.startswith("tls/"):
            form = "HOST or HOST:PORT: routers with certificates speak tls"
            raise BadAddress(known[name.partition("_")[2]], form)
    asked: set[str] = set()
    for process in here.values():
        asked |= _asked(process)
        for name in table.hosts:
            if placeholder(name) in asked and placeholder(name) not in routers:
                raise NoAddress(name, process.name)
    elsewhere = {
        name: process.host for name, process in table.processes.items() if name not in here
    }
    services = {
        services_placeholder(name): ",".join(services_on(table, name)) for name in table.hosts
    }
    used = {name: text for name, text in {**routers, **services}.items() if name in asked}
    return Table(table.source, here, table.hosts, host, elsewhere), used


def services_on(table: Table, host: str) -> list[str]:
    """List who speaks on a host: the services of its processes, and its supervisor."""
    services = [service_of(one.command) for one in table.processes.values() if one.host == host]
    return [*(one for one in services if one not in ("", ROUTER)), SUPERVISOR]


def _asked(process: Process) -> set[str]:
    """Collect the placeholders of a command."""
    parts = (part for word in process.command for part in Formatter().parse(word))
    return {field for _, field, _, _ in parts if field is not None}
