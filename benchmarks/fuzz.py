"""`fras bench fuzz`: hostile input against every decoder, every service and every reader of files.

It fails on another exception than a `FrasError`, more than some seconds for one payload, memory
that grows, a service that does not answer afterwards, a malformed payload that health does not
count, and a trial that goes another way because of payloads that are refused.
"""

import argparse
import logging
import sys
import tempfile
import time
from pathlib import Path

import structlog

from fras_common.threads import one_thread


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="fras bench fuzz", description=__doc__)
    parser.add_argument("--payloads", type=int, default=100_000, help="(default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="(default: %(default)s)")
    parser.add_argument(
        "--show", type=int, default=20, help="findings shown (default: %(default)s)"
    )
    options = parser.parse_args(argv)
    # Before any numerical library: a trial must go the same way twice.
    one_thread()
    from benchmarks.fuzz_rounds import fuzz

    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.CRITICAL))
    since_s = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="fras-fuzz-") as folder:
        found = fuzz(options.payloads, options.seed, Path(folder))
    for name, count in sorted(found.done.items()):
        print(f"{name:36} {count:9d}")
    print(f"slowest {found.slowest_s:.2f} s: {found.slowest}")
    print(f"{time.perf_counter() - since_s:.0f} s in all, seed {options.seed}")
    for problem in found.wrong[: options.show]:
        print(f"WRONG {problem}", file=sys.stderr)
    print(f"{len(found.wrong)} findings")
    return 1 if found.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
