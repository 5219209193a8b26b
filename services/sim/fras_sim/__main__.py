"""`python -m fras_sim`."""

import sys

from fras_common.signals import silent_interrupt
from fras_common.threads import one_thread


@silent_interrupt()
def main(argv: list[str] | None = None) -> int:
    """Run the service."""
    one_thread()
    from fras_common.service import run_service

    return run_service(
        "sim", "fras_sim.service:SimService", argv, "Simulate the tissue with finite elements."
    )


if __name__ == "__main__":
    sys.exit(main())
