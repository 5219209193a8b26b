"""A Zenoh router as a process of our own: `python -m fras_common.router --listen ENDPOINT`."""

import argparse
import sys

from fras_common.bus.zenoh_bus import NoRouter, route
from fras_common.service.signals import StopFlag


def main(argv: list[str] | None = None) -> int:
    """Route until told to stop."""
    parser = argparse.ArgumentParser(prog="fras router", description=__doc__)
    parser.add_argument("--listen", default="tcp/127.0.0.1:7447", help="endpoint to listen on")
    options = parser.parse_args(argv)
    stop = StopFlag()
    stop.install()
    try:
        route(options.listen, until=stop.wait)
    except NoRouter as error:
        print(f"fras router: {error}", file=sys.stderr)
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main())
