"""All benchmarks, briefly: `fras bench all [--only NAME ...] [--out DIR] [--page FILE]`.

Each one runs smaller than by itself, in a process of its own, so that all of them take a quarter of
an hour. Their figures go into one table, held against what is to be reached, and with `--page` into
`docs/benchmarks.md`, between the two comments that mark their place. One that can't run here (no
browser, no right to make network namespaces) or fails says so in its row; nothing of the rest is
lost. Left out are `fuzz` and `stress`, which look for faults and not for figures.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from benchmarks.brief_rows import JOBS, Job, Row
from benchmarks.machine import processor

from fras_common.commit import commit

BEGIN: Final = "<!-- written by `make bench`: begin -->"
END: Final = "<!-- written by `make bench`: end -->"
LONGEST_S: Final = 600.0


def run(job: Job, out: Path) -> list[Row]:
    """Run one benchmark and read its figures; what it says goes to a file beside them."""
    arguments = [one.format(out=out, name=job.name) for one in job.arguments]
    result = out / f"{job.name}.json"
    result.unlink(missing_ok=True)
    command = [sys.executable, "-m", job.module, *arguments]
    with (out / f"{job.name}.txt").open("w", encoding="utf-8") as said:
        try:
            done = subprocess.run(
                command, stdout=said, stderr=subprocess.STDOUT, check=False, timeout=LONGEST_S
            )
        except subprocess.TimeoutExpired:
            return [Row("not done", f"longer than {LONGEST_S:.0f} s")]
    if not result.exists():
        lines = (out / f"{job.name}.txt").read_text(encoding="utf-8").strip().splitlines()
        return [Row(f"not done (exit status {done.returncode})", lines[-1] if lines else "")]
    return job.rows(json.loads(result.read_text(encoding="utf-8")))


def table(found: Sequence[tuple[Job, list[Row]]]) -> list[str]:
    """Lay all rows out, as Markdown."""
    lines = ["| `fras bench` | what | figure | to reach | |", "|---|---|---:|---|---|"]
    for job, rows in found:
        for number, row in enumerate(rows):
            met = "" if row.met is None else ("met" if row.met else "**missed**")
            cells = [f"`{job.name}`" if number == 0 else "", row.what, row.figure, row.goal, met]
            lines.append(f"| {' | '.join(cell.replace('|', ',') for cell in cells)} |")
    return lines


def write(page: Path, lines: Sequence[str]) -> None:
    """Put the lines between the marks of a page, and leave the rest as it is.

    Raises
    ------
    SystemExit
        The page has no marks.
    """
    text = page.read_text(encoding="utf-8")
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise SystemExit(f"{page} has no place for the figures: it needs\n{BEGIN}\n{END}")
    page.write_text("\n".join([before + begin, "", *lines, "", end + after]), encoding="utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(prog="fras bench all", description=__doc__)
    parser.add_argument(
        "--only", nargs="+", metavar="NAME", choices=[job.name for job in JOBS], help="only these"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("runs/bench/all"), help="for what they say"
    )
    parser.add_argument("--page", type=Path, help="write the table there, too")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    jobs = [job for job in JOBS if not options.only or job.name in options.only]
    load_before = os.getloadavg()[0]
    began_s = time.monotonic()
    found: list[tuple[Job, list[Row]]] = []
    for number, job in enumerate(jobs, start=1):
        print(f"{number} of {len(jobs)}: {job.name} ...", end=" ", flush=True)
        job_began_s = time.monotonic()
        found.append((job, run(job, options.out)))
        print(f"{time.monotonic() - job_began_s:.0f} s", flush=True)
    took_min = (time.monotonic() - began_s) / 60.0
    lines = [
        f"{datetime.now(UTC).date()}, {commit()[:7] or 'no commit'}, {processor()}, "
        f"{os.cpu_count()} cores, load {load_before:.1f} before; {took_min:.0f} minutes in all.",
        "",
        *table(found),
    ]
    print("\n".join(lines))
    (options.out / "all.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    if options.page:
        write(options.page, lines)
    return int(any(row.what.startswith("not done") for _, rows in found for row in rows))


if __name__ == "__main__":
    sys.exit(main())
