"""`python -m fras_monitor`."""

import argparse
import os
import sys
from collections.abc import Sequence

from fras_common.threads import one_thread

PORT = 8080
TOKEN, VIEW_TOKEN = "FRAS_MONITOR_TOKEN", "FRAS_MONITOR_VIEW_TOKEN"


def add_arguments(parser: argparse.ArgumentParser) -> Sequence[str]:
    """Add where the page listens, and who may open it."""
    parser.add_argument(
        "--host",
        dest="host_name",
        metavar="ADDRESS",
        default="127.0.0.1",
        help="where to listen (default: %(default)s, this machine alone)",
    )
    parser.add_argument("--port", type=int, default=PORT, help="0: any free one (default: 8080)")
    parser.add_argument(
        "--token",
        default=os.environ.get(TOKEN, ""),
        help=f"what a browser must show to open the page (default: ${TOKEN})",
    )
    parser.add_argument(
        "--view-token",
        default=os.environ.get(VIEW_TOKEN, ""),
        help=f"what one must show who may only look (default: ${VIEW_TOKEN})",
    )
    parser.add_argument("--read-only", action="store_true", help="nobody may do more than look")
    return ("host_name", "port", "token", "view_token", "read_only")


def main(argv: list[str] | None = None) -> int:
    """Run the service."""
    one_thread()
    from fras_common.service import run_service

    return run_service(
        "monitor",
        "fras_monitor.service:build",
        argv,
        "Serve the surgeon's page.",
        add=add_arguments,
    )


if __name__ == "__main__":
    sys.exit(main())
