"""What recording and verifying cost: `python -m benchmarks.recorder [--json FILE]`.

Writes the same messages with the recorder's log, with the mcap library alone and to the disk alone,
in turn, and verifies the log; then sends a trial's traffic at 1, 10 and 50 times its rate through a
router and a recorder, and counts what is in the log. MB are of payload, before compression.
"""

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

from benchmarks import recorder_files, recorder_loss
from rich.console import Console
from rich.table import Table

LEAST_OF_BARE = 0.5
LEAST_VERIFY_MB_S = 100.0
LEAST_VERIFY_MESSAGES_S = 20_000


def targets(files: dict[str, dict[str, Any]], loss: list[dict[str, Any]]) -> dict[str, bool]:
    """Whether each figure is what it has to be."""
    return {
        f"small messages: {LEAST_OF_BARE} x the bare writer": (
            files["small"]["log_over_bare"] >= LEAST_OF_BARE
        ),
        f"tissue states: {LEAST_OF_BARE} x the bare writer": (
            files["states"]["log_over_bare"] >= LEAST_OF_BARE
        ),
        f"verify: {LEAST_VERIFY_MB_S:g} MB/s of tissue states": (
            files["states"]["mb_s"]["verify"] >= LEAST_VERIFY_MB_S
        ),
        f"verify: {LEAST_VERIFY_MESSAGES_S:,} small messages/s": (
            files["small"]["messages_s"]["verify"] >= LEAST_VERIFY_MESSAGES_S
        ),
        "nothing lost at 10 x a trial's rate": all(
            one["lost"] == 0 for one in loss if one["speed"] <= 10
        ),
    }


def show(figures: dict[str, Any], console: Console) -> None:
    """Print the figures and what is met and missed."""
    table = Table("", "small, MB/s", "small, messages/s", "states, MB/s", "states, messages/s")
    small, states = figures["files"]["small"], figures["files"]["states"]
    names = {
        "log": "the recorder's log, signed",
        "bare": "mcap's writer alone",
        "raw": "payloads to the disk",
        "verify": "verify",
    }
    for name, words in names.items():
        columns = [
            str(one[unit][name]) for one in (small, states) for unit in ("mb_s", "messages_s")
        ]
        table.add_row(words, *columns)
    console.print(table)
    console.print(
        f"{small['messages']} of {small['bytes_each']} bytes, {states['messages']} of "
        f"{states['bytes_each']}; beside the bare writer {small['log_over_bare']} x and "
        f"{states['log_over_bare']} x; verify needs {figures['verify_peak_mib']} MiB at most"
    )
    table = Table("times a trial's rate", "reached", "sent", "lost", "told", "recorder's CPU")
    for one in figures["loss"]:
        row = [one[name] for name in ("speed", "reached_speed", "sent", "lost", "lost_told")]
        table.add_row(*map(str, row), f"{one['cpu_percent']} %")
    console.print(table)
    for what, met in figures["targets"].items():
        console.print(f"{'met   ' if met else 'MISSED'} {what}")


def main() -> None:
    parser = argparse.ArgumentParser(prog="fras bench recorder", description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--small", type=int, default=50_000, help="small messages a round")
    parser.add_argument("--states", type=int, default=4_000, help="tissue states a round")
    parser.add_argument("--seconds", type=float, default=5.0, help="of traffic at each rate")
    parser.add_argument("--speeds", type=float, nargs="+", default=[1.0, 10.0, 50.0])
    parser.add_argument("--json", type=Path, help="also write the figures there")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        files = recorder_files.measure(Path(name), options.rounds, options.small, options.states)
        peak = recorder_files.verify_peak_mib(Path(name))
        loss = recorder_loss.measure(Path(name), options.speeds, options.seconds)
    figures = {
        "files": files,
        "verify_peak_mib": peak,
        "loss": loss,
        "targets": targets(files, loss),
    }
    show(figures, Console())
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
