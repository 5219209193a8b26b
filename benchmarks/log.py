"""What is done with a trial's log: `python -m benchmarks.log [--runs N] [--scenarios a,b,...]`.

Runs each scenario in real time, and then each command on its log as a user does: a process of its
own, start and libraries included. Exit status 1 if an audit takes longer than its trial took, or
an export of 300 ticks would take 10 s.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any, Final

from benchmarks.machine import processor
from rich.console import Console
from rich.table import Table

EXPORT_S: Final = 10.0
EXPORTED_TICKS: Final = 300
COMMANDS: Final = {
    "verify": ("log", "verify"),
    "audit": ("audit",),
    "foxglove": ("log", "export", "--foxglove", "--force"),
    "rerun": ("log", "export", "--rerun", "--force"),
}


def fras(*arguments: str) -> tuple[float, str]:
    """Run a command to its good end; its time [s] and output."""
    began_s = time.perf_counter()
    command = [sys.executable, "-m", "fras_cli", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    took_s = time.perf_counter() - began_s
    if done.returncode != 0:
        raise SystemExit(f"fras {' '.join(arguments)} failed:\n{done.stdout}{done.stderr}")
    return took_s, done.stdout


def measure(scenario: str, runs: int, folder: Path) -> dict[str, Any]:
    """Run a trial, and each command on its log several times."""
    out = folder / scenario
    _, said = fras("run", scenario, "--pace", "1", "--out", str(out), "--json")
    summary = json.loads(said.splitlines()[-1])
    figures = {
        name: median(fras(*command, str(out))[0] for _ in range(runs))
        for name, command in COMMANDS.items()
    }
    log_bytes = (out / "audit.mcap").stat().st_size
    return {
        "ticks": summary["ticks"],
        "log_mb": log_bytes / 1e6,
        "trial": summary["wall_s"],
        **figures,
    }


def misses(figures: dict[str, Any]) -> list[str]:
    """Name what took too long."""
    allowed_s = EXPORT_S * max(1.0, figures["ticks"] / EXPORTED_TICKS)
    slow = [name for name in ("foxglove", "rerun") if figures[name] > allowed_s]
    return slow + ["audit"] * (figures["audit"] > figures["trial"])


def main() -> None:
    parser = argparse.ArgumentParser(prog="fras bench log", description=__doc__)
    parser.add_argument("--runs", type=int, default=3, help="of each command")
    parser.add_argument("--scenarios", default="a,b,c,default", help="names or files")
    parser.add_argument("--json", type=Path, help="also write the figures there")
    options = parser.parse_args()
    if options.runs < 1:
        parser.error("--runs: at least one")
    load_before = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as name:
        scenarios = options.scenarios.split(",")
        measured = {one: measure(one, options.runs, Path(name)) for one in scenarios}
    table = Table("scenario", "ticks", "log [MB]", "trial [s]", *(f"{one} [s]" for one in COMMANDS))
    for scenario, figures in measured.items():
        ticks, *others = figures.values()
        table.add_row(scenario, str(ticks), *(f"{one:.1f}" for one in others))
    console = Console()
    console.print(table)
    load = [round(load_before, 1), round(os.getloadavg()[0], 1)]
    console.print(f"medians of {options.runs} runs; load {load}")
    if options.json:
        made = {"processor": processor(), "load": load, "scenarios": measured}
        options.json.write_text(json.dumps(made, indent=2) + "\n")
    missed = [f"{one}: {name}" for one, figures in measured.items() for name in misses(figures)]
    if missed:
        raise SystemExit(f"too slow: {', '.join(missed)}")


if __name__ == "__main__":
    main()
