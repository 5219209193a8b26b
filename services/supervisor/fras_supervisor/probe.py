"""`python -m fras_supervisor.probe`: is a process ready? For health checks of containers."""

import argparse
import sys
from pathlib import Path

from fras_common.bus import NoAnswer
from fras_common.bus.zenoh_bus import NoRouter, ZenohBus
from fras_common.identity import BadIdentity, identity_in
from fras_supervisor.errors import BadEndpoint
from fras_supervisor.ports import Endpoint, accepts

TIMEOUT_S = 5.0


def main(argv: list[str] | None = None) -> int:
    """Tell whether the router answers and shows a token.

    Returns
    -------
    int
        0 if so, else 1.
    """
    parser = argparse.ArgumentParser(prog="fras_supervisor.probe", description=__doc__)
    parser.add_argument("token", nargs="?", default="", help="ready/sim, alive/arms; default: none")
    parser.add_argument("--cell", default="local")
    parser.add_argument("--connect", default="tcp/127.0.0.1:7447")
    parser.add_argument("--tls", type=Path, metavar="DIR", help="folder of `fras keys`")
    parser.add_argument("--name", default="", help="with --tls, whose certificate to show")
    options = parser.parse_args(argv)
    try:
        if options.tls is not None and not options.token:
            # A router's certificate is no client's: it is asked only whether it listens.
            return 0 if accepts(Endpoint.parse(options.connect)) else 1
        identity = identity_in(options.tls, options.name) if options.tls is not None else None
        bus = ZenohBus(
            options.cell,
            options.connect,
            "probe/1",
            open_timeout_s=TIMEOUT_S,
            identity=identity,
        )
    except (NoRouter, BadIdentity, BadEndpoint) as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return 1
    try:
        tokens = {token.rpartition("/")[0] for token in bus.tokens(TIMEOUT_S)}
    except NoAnswer as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return 1
    finally:
        bus.close()
    if options.token and options.token not in tokens:
        there = ", ".join(sorted(tokens)) or "none"
        print(f"{parser.prog}: no token {options.token}; there are {there}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
