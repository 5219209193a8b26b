"""`python -m fras_sim.patient_main`: the simulator in the part of the patient."""

import sys

from fras_common.signals import silent_interrupt
from fras_common.threads import one_thread


@silent_interrupt()
def main(argv: list[str] | None = None) -> int:
    """Run the service."""
    one_thread()
    from fras_common.service import run_service

    return run_service(
        "patient",
        "fras_sim.service:patient_service",
        argv,
        "Simulate the tissue that is seen, where it is another than its model.",
        extra="sim",
    )


if __name__ == "__main__":
    sys.exit(main())
