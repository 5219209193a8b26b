"""Addresses and TCP ports: which one is free, who holds one, does it accept."""

import re
import secrets
import socket
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import psutil

from fras_supervisor.errors import AddressNotHere, BadEndpoint, PortTaken

FIRST_PORT: Final = 20_000
TRIES: Final = 200
WILDCARDS: Final = {"0.0.0.0": "127.0.0.1", "::": "::1"}


@dataclass(frozen=True)
class Endpoint:
    """A Zenoh locator such as `tcp/127.0.0.1:7447` or `tls/[::1]:7447`."""

    protocol: str
    host: str
    port: int

    @classmethod
    def parse(cls, text: str) -> "Endpoint":
        """Read a locator; `BadEndpoint` if it is none."""
        found = re.fullmatch(r"(tcp|tls)/(\[[0-9a-fA-F:.]+\]|[^:/\[\]\s]+):(\d{1,5})", text)
        if found is None or not 0 < int(found[3]) < 65536:
            raise BadEndpoint(text)
        return cls(found[1], found[2].strip("[]"), int(found[3]))


def free_port(host: str = "127.0.0.1") -> int:
    """Find a TCP port that nobody holds on `host`.

    Notes
    -----
    Not asked of the kernel (bind to port 0): that yields a port of the range from which outgoing
    connections draw theirs, so one of them could take it before the router does, and a probe of
    it can connect to itself. Ports below that range stay free until somebody binds them.
    Two stacks can still draw the same port; the later one then gets `PortTaken`.

    Raises
    ------
    PortTaken
        None of many drawn ports was free.
    """
    ceiling = _first_ephemeral_port()
    first = FIRST_PORT if ceiling > FIRST_PORT + TRIES else 1024
    port = first
    for _ in range(TRIES):
        port = first + secrets.randbelow(max(ceiling - first, TRIES))
        if _can_bind(host, port):
            return port
    raise PortTaken(port, holder_of(port))


def require_free(endpoint: Endpoint) -> None:
    """Raise an error unless the port can be bound.

    Raises
    ------
    AddressNotHere
        The address is none of this machine's.
    PortTaken
        Naming the holder if that can be told.
    """
    if not _can_bind(endpoint.host, endpoint.port):
        if not _can_bind(endpoint.host, 0):
            raise AddressNotHere(endpoint.host)
        raise PortTaken(endpoint.port, holder_of(endpoint.port))


def accepts(endpoint: Endpoint, timeout_s: float = 0.2) -> bool:
    """Tell whether something accepts connections there."""
    host = WILDCARDS.get(endpoint.host, endpoint.host)
    try:
        with socket.create_connection((host, endpoint.port), timeout_s) as connection:
            # TCP lets a socket connect to itself if it happens to draw the port it dials.
            return connection.getsockname() != connection.getpeername()
    except OSError:
        return False


def holder_of(port: int) -> str | None:
    """Name the process that listens on a port, or nothing if we may not know."""
    try:
        for connection in psutil.net_connections(kind="tcp"):
            if (
                connection.status == psutil.CONN_LISTEN
                and connection.laddr
                and connection.laddr.port == port
                and connection.pid is not None
            ):
                command = " ".join(psutil.Process(connection.pid).cmdline())
                return f"pid {connection.pid} ({command})"
    except psutil.Error:
        return None
    return None


def _can_bind(host: str, port: int) -> bool:
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM
        )[0]
    except socket.gaierror as error:
        raise BadEndpoint(f"tcp/{host}:{port}") from error
    with socket.socket(family, kind, protocol) as probe:
        # Closed connections linger on a port for a minute; only a living listener counts.
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(address)
        except OSError:
            return False
    return True


def _first_ephemeral_port() -> int:
    """Where the kernel's range for outgoing connections begins."""
    try:
        return int(Path("/proc/sys/net/ipv4/ip_local_port_range").read_text("ascii").split()[0])
    except OSError:
        return 32_768
