"""`python -m fras_recorder`."""

import sys

from fras_common.service import run_service


def main(argv: list[str] | None = None) -> int:
    """Run the recorder."""
    return run_service(
        "recorder", "fras_recorder.service:RecorderService", argv, "Record all traffic to MCAP."
    )


if __name__ == "__main__":
    sys.exit(main())
