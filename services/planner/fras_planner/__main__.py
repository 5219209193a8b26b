"""`python -m fras_planner`."""

import sys

from fras_common.signals import silent_interrupt
from fras_common.threads import one_thread


@silent_interrupt()
def main(argv: list[str] | None = None) -> int:
    """Run the planner and its executive."""
    one_thread()
    from fras_common.service import run_service

    return run_service(
        "planner",
        "fras_planner.service:PlannerService",
        argv,
        "Plan in Answer Set Programming, and act.",
        paths={"asp_dir": "rules of your own, laid out like asp/"},
    )


if __name__ == "__main__":
    sys.exit(main())
