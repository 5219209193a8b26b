"""`python -m fras_recorder`."""

import os
import sys

from fras_common.signals import silent_interrupt
from fras_common.threads import one_thread

# The recorder hears each message at the moment when the next process of the loop has to act on it.
NICENESS = 5


@silent_interrupt()
def main(argv: list[str] | None = None) -> int:
    """Run the recorder, behind the processes that the arms wait for."""
    if argv is None:  # a process of its own
        os.nice(NICENESS)
    one_thread()
    from fras_common.service import run_service

    return run_service(
        "recorder",
        "fras_recorder.service:RecorderService",
        argv,
        "Record all traffic to MCAP.",
        paths={
            "key": "private key that signs the logs (default: this machine's own)",
            "below": "the only folder below which logs may stand (default: anywhere)",
        },
        choices={"sign": ("yes", "no")},
    )


if __name__ == "__main__":
    sys.exit(main())
