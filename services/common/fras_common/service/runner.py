"""The main function of every service process."""

import argparse
import gc
import importlib
import sys
import threading
import uuid
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Protocol

from fras_common.bus import Bus
from fras_common.bus.zenoh_bus import NoRouter, ZenohBus
from fras_common.errors import FrasError
from fras_common.extras import MissingExtra, require_extra
from fras_common.identity import BadIdentity, identity_in
from fras_common.service.host import ServiceHost
from fras_common.service.logs import configure_logging
from fras_common.signals import StopFlag

EXIT_START = 3


class CannotStart(FrasError):
    """A shell that can't be made of what it was given."""


class Service(Protocol):
    """A shell: declares itself on the host, and does what is due by time."""

    def wake(self) -> float | None:
        """Do what is due; return the seconds until the next time, or None."""
        ...

    def close(self) -> None:
        """Leave everything in order; the bus is still open."""
        ...


Build = Callable[..., Service]
AddArguments = Callable[[argparse.ArgumentParser], Sequence[str]]


def make_parser(
    name: str,
    description: str,
    paths: Mapping[str, str] | None = None,
    choices: Mapping[str, Sequence[str]] | None = None,
) -> argparse.ArgumentParser:
    """Arguments that every service takes, and the paths and choices that this one does."""
    parser = argparse.ArgumentParser(prog=f"fras {name}", description=description)
    parser.add_argument("--cell", default="local", help="cell (Zenoh namespace fras/<cell>)")
    parser.add_argument(
        "--connect", default="tcp/127.0.0.1:7447", help="endpoint of the Zenoh router"
    )
    parser.add_argument(
        "--tls", type=Path, metavar="DIR", help="folder of `fras keys` with this service's own"
    )
    parser.add_argument(
        "--instance",
        default="",
        help="name of this instance, another at each start (default: random)",
    )
    parser.add_argument(
        "--log-level", default="INFO", choices=["DEBUG", "INFO", "WARNING", "ERROR"]
    )
    for path, help_text in (paths or {}).items():
        flag = "--" + path.replace("_", "-")
        parser.add_argument(flag, dest=path, type=Path, metavar="PATH", help=help_text)
    for choice, allowed in (choices or {}).items():
        parser.add_argument(
            f"--{choice}", choices=allowed, default=allowed[0], help="(default: %(default)s)"
        )
    return parser


def parse_arguments(
    name: str,
    argv: list[str] | None,
    description: str,
    paths: Mapping[str, str] | None = None,
    choices: Mapping[str, Sequence[str]] | None = None,
) -> argparse.Namespace:
    """Read them from a command line."""
    return make_parser(name, description, paths, choices).parse_args(argv)


def run_service(
    name: str,
    shell: str,
    argv: list[str] | None = None,
    description: str = "",
    paths: Mapping[str, str] | None = None,
    choices: Mapping[str, Sequence[str]] | None = None,
    extra: str = "",
    add: AddArguments = lambda parser: (),
) -> int:
    """Run a service until it is told to stop.

    Parameters
    ----------
    name : str
        Name in the topic table.
    shell : str
        `module:attribute` of what makes the shell on an attached host; imported here, so that
        `--help` needs none of its libraries and a missing one is named.
    argv : list of str, optional
        Command line without the program's name.
    description : str
        First line of `--help`.
    paths : mapping of str to str, optional
        Names of files and folders that the shell takes, as keywords, with their help.
    choices : mapping of str to sequence of str, optional
        Names of options that the shell takes, as keywords, with what they may be; the first is the
        default.
    extra : str
        Which of the distribution's extras holds its libraries; by default that of its own name.
    add : callable, optional
        Adds arguments of another kind to the parser, and names those that the shell takes.

    Returns
    -------
    int
        Exit status: 0 after a stop (one that comes before the libraries are loaded ends the process
        by its signal), 3 if a library is missing, the router can't be reached, the
        keys can't be used or the shell can't be made of what it was given.
    """
    parser = make_parser(name, description, paths, choices)
    own = (*(paths or ()), *(choices or ()), *add(parser))
    options = parser.parse_args(argv)
    given = {option: getattr(options, option) for option in own}
    host = ServiceHost(name)
    host.log = configure_logging(name, options.log_level, host.publish_log)
    instance = options.instance or uuid.uuid4().hex[:4]
    try:
        with require_extra(extra or name):
            build = _load(shell)
    except MissingExtra as error:
        print(f"fras {name}: {error}", file=sys.stderr)
        return EXIT_START
    # Not before: whoever is stopped while libraries are loaded ends at once.
    stop = StopFlag()
    stop.install()
    try:
        bus = ZenohBus(
            options.cell,
            options.connect,
            f"{name}/{instance}",
            on_malformed=host.count_malformed,
            identity=identity_in(options.tls, name) if options.tls is not None else None,
        )
    except (BadIdentity, NoRouter) as error:
        print(f"fras {name}: {error}", file=sys.stderr)
        return EXIT_START
    try:
        serve(host, bus, partial(build, **given), stop)
    except CannotStart as error:
        print(f"fras {name}: {error}", file=sys.stderr)
        return EXIT_START
    finally:
        bus.close()
    return 0


def _load(shell: str) -> Build:
    module, _, attribute = shell.partition(":")
    return getattr(importlib.import_module(module), attribute)


def serve(host: ServiceHost, bus: Bus, build: Build, stop: StopFlag) -> None:
    """Attach, announce, and loop until `stop`."""
    host.attach(bus)
    try:
        service = build(host)
    except FrasError as error:
        raise CannotStart(str(error)) from error
    run_shell(host, service, stop)


def run_shell(host: ServiceHost, service: Service, stop: StopFlag) -> None:
    """Announce a shell that is made, and loop until `stop`."""
    health_stop = threading.Event()
    health = threading.Thread(
        target=host.report_health, args=(health_stop,), name="health", daemon=True
    )
    health.start()
    stop.on_set = host.stop
    try:
        # What was made to start up stays; the collector need not look at it in mid-tick.
        gc.freeze()
        host.announce_alive()
        if not stop.is_set():
            host.run(service.wake)
    finally:
        health_stop.set()
        health.join()
        service.close()
