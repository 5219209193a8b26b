"""What can go wrong while a stack is read, started and stopped."""

from collections.abc import Sequence
from pathlib import Path

from fras_common.errors import FrasError, shown


class TableError(FrasError):
    """A process table says something it may not."""

    file: str
    key: str
    value: object
    allowed: str

    def __init__(self, file: str, key: str, value: object, allowed: str) -> None:
        super().__init__(
            f"{file}: {key} = {shown(value)} is not allowed; allowed: {allowed}",
            file=file,
            key=key,
            value=value,
            allowed=allowed,
        )


class BadEndpoint(FrasError):
    """An address is not of the form that Zenoh and the supervisor understand."""

    endpoint: str

    def __init__(self, endpoint: str) -> None:
        super().__init__(
            f"endpoint {endpoint!r} is not an address; write it as tcp/HOST:PORT or tls/HOST:PORT "
            "with a port from 1 to 65535, for example tcp/127.0.0.1:7447",
            endpoint=endpoint,
        )


class BadAddress(FrasError):
    """What should say where a host's router is does not."""

    address: str

    def __init__(
        self,
        address: str,
        form: str = "HOST or HOST:PORT, as 10.0.0.1, robot.lan:7447 or [fd00::1]:7447",
    ) -> None:
        super().__init__(
            f"{address!r} is not the address of a host; write it as {form}", address=address
        )


class UnknownHost(FrasError):
    """A process table has no host of that name."""

    host: str

    def __init__(self, file: str, host: str, known: Sequence[str]) -> None:
        there = f"it has {', '.join(known)}" if known else "it has no table [host.NAME] at all"
        super().__init__(f"{file}: there is no host {host!r}; {there}", file=file, host=host)


class NothingOnHost(FrasError):
    """No process of the table runs on that host."""

    host: str

    def __init__(self, file: str, host: str) -> None:
        super().__init__(
            f"{file}: no process is of host {host}: give one `host = {host!r}`, or choose another "
            "host",
            file=file,
            host=host,
        )


class NoAddress(FrasError):
    """A command needs the router of a host whose address nobody gave."""

    host: str
    name: str

    def __init__(self, host: str, name: str) -> None:
        super().__init__(
            f"process {name} asks for the router of host {host}, and its address is not known: "
            f"give it with --address {host}=HOST[:PORT], or as `address` in [host.{host}]",
            host=host,
            name=name,
        )


class OnOtherHost(FrasError):
    """A process that another host's supervisor keeps."""

    name: str
    host: str

    def __init__(self, name: str, host: str) -> None:
        super().__init__(
            f"process {name} is of host {host}: ask there, or with --connect and the endpoint of "
            f"{host}'s router",
            name=name,
            host=host,
        )


class AddressNotHere(FrasError):
    """A router is to listen on an address that is none of this machine's."""

    address: str

    def __init__(self, address: str) -> None:
        super().__init__(
            f"{address} is no address of this machine (`ip address` lists them): correct --address "
            "of this host",
            address=address,
        )


class PortTaken(FrasError):
    """Another process listens where the router should."""

    port: int
    holder: str | None

    def __init__(self, port: int, holder: str | None = None) -> None:
        super().__init__(
            f"port {port} is taken by {holder or 'another process'}; stop it, or choose "
            "another port with --port",
            port=port,
            holder=holder,
        )


class CommandNotFound(FrasError):
    """A command of the table can't be run on this machine."""

    name: str
    command: str
    reason: str

    def __init__(self, name: str, command: str, reason: str = "no such program") -> None:
        super().__init__(
            f"process {name}: {command!r} can't be run ({reason}); install it or correct "
            f"process.{name}.command in the process table",
            name=name,
            command=command,
            reason=reason,
        )


class LogDirUnusable(FrasError):
    """The folder for the logs can't be written."""

    path: Path
    reason: str

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(
            f"log folder {path} can't be written ({reason}); choose another one or free space",
            path=path,
            reason=reason,
        )


class LimitRefused(FrasError):
    """The system does not let us limit a process as the table asks."""

    name: str
    limits: str
    reason: str

    def __init__(self, name: str, limits: str, reason: str) -> None:
        super().__init__(
            f"process {name}: {limits} can't be set ({reason}); a negative nice and more open "
            "files than the supervisor's need a privilege: leave them out, or grant it",
            name=name,
            limits=limits,
            reason=reason,
        )


class UnknownProcess(FrasError):
    """No process of that name is in the table."""

    name: str

    def __init__(self, name: str, known: Sequence[str]) -> None:
        super().__init__(
            f"there is no process {name!r} in the table; there are {', '.join(known)}", name=name
        )


class ServiceDied(FrasError):
    """A process ended while the stack was being started."""

    name: str
    returncode: int
    last_lines: tuple[str, ...]

    def __init__(self, name: str, returncode: int, last_lines: Sequence[str]) -> None:
        super().__init__(
            f"process {name} died at start, {describe_returncode(returncode)}; its log ends:\n"
            + quote(last_lines),
            name=name,
            returncode=returncode,
            last_lines=tuple(last_lines),
        )


class NotReady(FrasError):
    """A process lives but did not become ready within its `ready_timeout_s`."""

    name: str
    waited_s: float
    last_lines: tuple[str, ...]
    waiting: tuple[str, ...]

    def __init__(
        self, name: str, waited_s: float, last_lines: Sequence[str], waiting: Sequence[str] = ()
    ) -> None:
        super().__init__(
            f"process {name} was not ready after {waited_s:.1f} s (not ready: "
            f"{', '.join(waiting or (name,))}); its log ends:\n" + quote(last_lines),
            name=name,
            waited_s=waited_s,
            last_lines=tuple(last_lines),
            waiting=tuple(waiting or (name,)),
        )


class StartCancelled(FrasError):
    """Somebody asked to stop while the stack was being started."""

    waiting: tuple[str, ...]

    def __init__(self, waiting: Sequence[str]) -> None:
        super().__init__(
            f"start cancelled while waiting for {', '.join(waiting)}; everything was stopped",
            waiting=tuple(waiting),
        )


class AlreadyStarted(FrasError):
    """One stack is started once; a second start needs a second stack."""

    def __init__(self) -> None:
        super().__init__("this stack was started before; make a new Stack to start again")


class Unstoppable(FrasError):
    """Processes outlived SIGKILL (stuck in the kernel, usually on a dead disk or mount)."""

    pids: dict[str, int]

    def __init__(self, pids: dict[str, int]) -> None:
        named = ", ".join(f"{name} (pid {pid})" for name, pid in pids.items())
        super().__init__(
            f"{named} did not end after SIGKILL; look for a stuck disk or mount they wait for",
            pids=pids,
        )


def describe_returncode(returncode: int) -> str:
    """Say a return code in words; negative codes are signals, as in `subprocess`."""
    return f"by signal {-returncode}" if returncode < 0 else f"with exit status {returncode}"


def quote(lines: Sequence[str]) -> str:
    """Indent log lines for an error's text."""
    return "\n".join(f"    {line}" for line in lines) or "    (it wrote nothing)"
