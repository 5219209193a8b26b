"""On which host a process runs: a supervisor starts those of its own."""

import re
import socket
from collections.abc import Mapping, Sequence
from typing import Final, Protocol, cast

from fras_supervisor.errors import BadAddress, BadEndpoint, TableError
from fras_supervisor.ports import Endpoint

PORT: Final = 7447
"""Of a router whose address names none."""

HOST_KEYS: Final = "address: HOST or HOST:PORT, where the other hosts reach its router"


class Hosted(Protocol):
    """What placing needs to know of a process."""

    @property
    def name(self) -> str:
        """Its name in the table."""
        ...

    @property
    def host(self) -> str:
        """Where it runs."""
        ...

    @property
    def needs(self) -> tuple[str, ...]:
        """Names that must be ready before it starts."""
        ...

    @property
    def outlives(self) -> tuple[str, ...]:
        """Names that must have ended before it is asked to stop."""
        ...


def placeholder(host: str) -> str:
    """Name what a command writes in braces for the endpoint of a host's router."""
    return f"router_{host}"


def services_placeholder(host: str) -> str:
    """Name what a command writes in braces for the services of a host, with commas between."""
    return f"services_{host}"


def endpoint_at(address: str, port: int = PORT, protocol: str = "tcp") -> str:
    """Make a router's endpoint of `HOST`, `HOST:PORT`, or an endpoint.

    Raises
    ------
    BadAddress
    """
    text = address if "/" in address else f"{protocol}/{address}"
    if not re.search(r"[^:]:\d+$|\]:\d+$", text):
        text = f"{text}:{port}"
    try:
        Endpoint.parse(text)
    except BadEndpoint as error:
        raise BadAddress(address) from error
    return text


def read_addresses(texts: Sequence[str]) -> dict[str, str]:
    """Read `HOST=ADDRESS`, each host once.

    Raises
    ------
    BadAddress
    """
    addresses: dict[str, str] = {}
    for text in texts:
        host, equals, address = text.partition("=")
        if not equals or not host or not address or host in addresses:
            raise BadAddress(text, "NAME=HOST[:PORT], each name once, as A=10.0.0.1")
        addresses[host] = address
    return addresses


def read_hosts(source: str, raw: object) -> dict[str, str]:
    """Read the tables `[host.NAME]`: names, each with its address, or none if it is not known yet.

    Raises
    ------
    TableError
    """
    if not isinstance(raw, dict):
        raise TableError(source, "host", raw, "tables [host.NAME]")
    hosts: dict[str, str] = {}
    for name, row in cast("dict[str, object]", raw).items():
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9-]*", name):
            raise TableError(source, f"host.{name}", name, "a name of letters, digits and dashes")
        if not isinstance(row, dict):
            raise TableError(source, f"host.{name}", row, f"a table of {HOST_KEYS}")
        fields = cast("dict[str, object]", row)
        for key, value in fields.items():
            if key != "address" or not isinstance(value, str):
                raise TableError(source, f"host.{name}.{key}", value, HOST_KEYS)
        hosts[name] = str(fields.get("address", ""))
        if hosts[name]:
            endpoint_at(hosts[name])
    return hosts


def check_hosts(source: str, processes: Mapping[str, Hosted], hosts: Mapping[str, str]) -> None:
    """Refuse a process of no host of the table, or one that waits for one of another host.

    Raises
    ------
    TableError
    """
    if not hosts:
        return
    for process in processes.values():
        if process.host not in hosts:
            key = f"process.{process.name}.host"
            raise TableError(source, key, process.host, f"a host of this table: {', '.join(hosts)}")
        for key, names in (("needs", process.needs), ("outlives", process.outlives)):
            for name in names:
                if processes[name].host != process.host:
                    raise TableError(
                        source,
                        f"process.{process.name}.{key}",
                        name,
                        f"processes of its own host, {process.host}: a supervisor starts and "
                        "stops those alone",
                    )


def require_here(source: str, process: Hosted) -> None:
    """Refuse a process of another host rather than ignore where it belongs.

    Raises
    ------
    TableError
    """
    here = socket.gethostname()
    if process.host not in ("localhost", here):
        raise TableError(
            source,
            f"process.{process.name}.host",
            process.host,
            f"localhost or {here}; `fras up --host {process.host}` starts those of a host that "
            "has a table [host.NAME]; else leave it out and start it there by hand, with --connect",
        )
