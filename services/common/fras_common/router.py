"""A Zenoh router as a process of our own: `python -m fras_common.router --listen ENDPOINT`."""

import argparse
import sys
from pathlib import Path

from fras_common.identity import BadIdentity, certificate_names, identity_in
from fras_common.signals import StopFlag, silent_interrupt

ROUTER = "router"
DEFAULT = "tcp/127.0.0.1:7447"


def link(text: str) -> tuple[str, list[str]]:
    """Read `router-b=sim,sa`: who may speak through another router.

    Raises
    ------
    ArgumentTypeError
    """
    from fras_common.access import LINK, PARTICIPANTS

    router, equals, behind = text.partition("=")
    names = list(dict.fromkeys(filter(None, behind.split(","))))
    if not equals or not router.startswith(LINK):
        raise argparse.ArgumentTypeError(f"{text!r}: write it as {LINK}b=sim,sa")
    if strangers := [name for name in names if name not in PARTICIPANTS]:
        raise argparse.ArgumentTypeError(
            f"{', '.join(strangers)}: has no rights; there are {', '.join(PARTICIPANTS)}"
        )
    return router, names


@silent_interrupt()
def main(argv: list[str] | None = None) -> int:
    """Route until told to stop."""
    from fras_common.bus.settings import NoRouter
    from fras_common.bus.zenoh_router import route

    parser = argparse.ArgumentParser(prog="fras router", description=__doc__)
    parser.add_argument(
        "--listen",
        action="append",
        metavar="ENDPOINT",
        help="listen there; may be given several times (default: tcp/127.0.0.1:7447)",
    )
    parser.add_argument(
        "--connect",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="link to the router there, now or when it is; may be given several times",
    )
    parser.add_argument(
        "--tls",
        type=Path,
        metavar="DIR",
        help="folder of `fras keys`: let in who shows a certificate of its CA, with its own rights",
    )
    parser.add_argument(
        "--name", default=ROUTER, help="with --tls, its certificate there (default: router)"
    )
    parser.add_argument(
        "--link",
        action="append",
        default=[],
        type=link,
        metavar="ROUTER=SERVICE,...",
        help="with --tls, another router, by its certificate, and who speaks through it",
    )
    parser.add_argument("--cell", default="local", help="with --tls, the one cell to serve")
    parser.add_argument(
        "--replays", action="store_true", help="with --tls, let `fras replay` speak for everybody"
    )
    options = parser.parse_args(argv)
    stop = StopFlag()
    stop.install()
    try:
        listen = options.listen or [DEFAULT]
        if options.tls is None:
            route(listen, until=stop.wait, connect=options.connect)
        else:
            # Not at the top: everybody waits for the router, and a plain one needs no rules.
            from fras_common.access import access_control

            identity = identity_in(options.tls, options.name)
            access = access_control(
                options.cell,
                replays=options.replays,
                names=certificate_names(options.tls),
                links=dict(options.link),
            )
            route(listen, stop.wait, identity, access, options.connect)
    except (BadIdentity, NoRouter) as error:
        print(f"fras router: {error}", file=sys.stderr)
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main())
