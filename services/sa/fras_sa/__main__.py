"""`python -m fras_sa`."""

import sys

from fras_common.service import run_service


def main(argv: list[str] | None = None) -> int:
    """Run the service."""
    return run_service(
        "sa",
        "fras_sa.service:AwarenessService",
        argv,
        "Judge force and visibility, tell the situation.",
    )


if __name__ == "__main__":
    sys.exit(main())
