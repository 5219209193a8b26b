"""`python -m fras_motion.arms_main`."""

import sys

from fras_common.signals import silent_interrupt
from fras_common.threads import one_thread


@silent_interrupt()
def main(argv: list[str] | None = None) -> int:
    """Run simulated arms under the keys of CRTK."""
    one_thread()
    from fras_common.service import run_service

    return run_service(
        "arms",
        "fras_motion.arms:ArmsService",
        argv,
        "Play two PSMs under the keys of CRTK, as a bridge to a dVRK would.",
        extra="motion",
    )


if __name__ == "__main__":
    sys.exit(main())
