"""How long a stack takes to be ready: `python -m benchmarks.start [--runs N] [--json FILE]`.

Starts all processes of `compose/local.toml` and stops them again. Of each: when it was ready, from
the start of the stack, and the processor time that it had used by the time that all were: beside
other work the first depends on that work, the second much less.
"""

import argparse
import json
import os
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

import psutil
from benchmarks.machine import processor
from rich.console import Console
from rich.table import Table

from fras_cli.link import Link
from fras_supervisor import Stack, find_table, free_port, load_table


def start_once() -> dict[str, Any]:
    """Start a stack; when each process was ready [s], and its processor time until all were [s]."""
    connect = f"tcp/127.0.0.1:{free_port()}"
    table = load_table(find_table("local"))
    with tempfile.TemporaryDirectory() as name, Link("bench-start", connect) as link:
        began_s = time.monotonic()
        stack = Stack(table, "bench-start", connect, Path(name), link.tokens)
        with stack:
            ready_s = time.monotonic() - began_s
            found = {
                one.name: (one.ready_after_s, sum(psutil.Process(one.pid).cpu_times()[:2]))
                for one in stack.status()
            }
    return {"ready_s": ready_s, "processes": found}


def main() -> None:
    parser = argparse.ArgumentParser(prog="fras bench start", description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--json", type=Path, help="also write the figures there")
    options = parser.parse_args()
    if options.runs < 1:
        parser.error("--runs: at least one")
    load_before = os.getloadavg()[0]
    runs = [start_once() for _ in range(options.runs)]
    table = Table("process", "ready after [s]", "processor [s]")
    figures: dict[str, Any] = {}
    for name in runs[0]["processes"]:
        ready_s, cpu_s = (
            median(column) for column in zip(*(run["processes"][name] for run in runs), strict=True)
        )
        figures[name] = {"ready_s": round(ready_s, 2), "processor_s": round(cpu_s, 2)}
        table.add_row(name, f"{ready_s:.2f}", f"{cpu_s:.2f}")
    all_ready_s = [round(run["ready_s"], 2) for run in runs]
    cpu_s = median(sum(cpu for _, cpu in run["processes"].values()) for run in runs)
    table.add_row("all", f"{median(all_ready_s):.2f}", f"{cpu_s:.2f}")
    console = Console()
    console.print(table)
    load = [round(load_before, 1), round(os.getloadavg()[0], 1)]
    console.print(f"medians of {len(runs)} runs; all ready after {all_ready_s} s; load {load}")
    if options.json:
        made = {
            "processor": processor(),
            "load": load,
            "ready_s": all_ready_s,
            "processor_s": round(cpu_s, 2),
            "processes": figures,
        }
        options.json.write_text(json.dumps(made, indent=2) + "\n")


if __name__ == "__main__":
    main()
