"""A tick over a network: `python -m benchmarks.hosts [--rtt MS ...] [--trials N] [--json FILE]`.

The stack of `compose/two-hosts.toml` in two network namespaces, joined by a wire that holds every
frame back (`benchmarks/wire.py`); trials run as fast as possible, and each tick's duration comes
from the audit log. Needs root, `ip` and TAP devices.
"""

# matplotlib ships no complete types.
# pyright: reportUnknownMemberType=false

import argparse
import json
import subprocess
import sys
import tempfile
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
from benchmarks.machine import processor
from benchmarks.two_hosts import TwoHosts
from benchmarks.wire import ADDRESSES, NotPermitted, Wire
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from fras_cli.report import read_trial

RTT_MS: Final = (0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
REAL_TIME_MS: Final = 20.0
PORT: Final = 7500

ECHO: Final = """
import socket, sys
with socket.create_server((sys.argv[1], int(sys.argv[2]))) as server:
    connection, _ = server.accept()
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    while data := connection.recv(4096):
        connection.sendall(data)
"""
PING: Final = """
import socket, statistics, sys, time
deadline_s = time.monotonic() + 10.0
while True:
    try:
        connection = socket.create_connection((sys.argv[1], int(sys.argv[2])), 5.0)
        break
    except OSError:
        if time.monotonic() > deadline_s:
            raise
        time.sleep(0.05)
connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
took_s = []
for _ in range(50):
    began_s = time.perf_counter()
    connection.sendall(b"x" * 64)
    connection.recv(4096)
    took_s.append(time.perf_counter() - began_s)
print(statistics.median(took_s) * 1e3)
"""


def round_trip_ms(wire: Wire) -> float:
    """Round trip of 64 bytes over TCP, as two plain processes see it [ms]."""
    where = (ADDRESSES["B"], str(PORT))
    with subprocess.Popen(wire.command("B", sys.executable, "-c", ECHO, *where)) as echo:
        try:
            ping = wire.command("A", sys.executable, "-c", PING, *where)
            return float(subprocess.run(ping, check=True, capture_output=True, text=True).stdout)
        finally:
            echo.kill()


def ticks_ms(log: Path) -> list[float]:
    """Each tick's duration within an action [ms]."""
    robot = read_trial(log).robot
    return [
        (state.stamp_ns - before.stamp_ns) / 1e6
        for before, state in pairwise(robot)
        if before.goal_id == state.goal_id != "" and not (before.held or state.held)
    ]


def measure(rtts_ms: list[float], trials: int, console: Console) -> list[dict[str, Any]]:
    """Run the trials at each round-trip time."""
    rows: list[dict[str, Any]] = []
    with (
        tempfile.TemporaryDirectory() as name,
        Wire() as wire,
        TwoHosts(wire, Path(name)) as hosts,
    ):
        hosts.run("a", "warm-up", "--pace", "0")
        for rtt_ms in rtts_ms:
            wire.delay_s = rtt_ms * 0.5e-3
            measured_ms = round_trip_ms(wire)
            took_ms: list[float] = []
            lost = 0
            for trial in range(trials):
                out = f"{rtt_ms:g}-{trial}"
                summary = hosts.run("a", out, "--pace", "0")
                if summary["outcome"] != "success":
                    raise RuntimeError(f"the trial at {rtt_ms} ms ended {summary['reason']}")
                lost += summary["lost"]
                took_ms += ticks_ms(hosts.log(out))
            p50, p99 = np.percentile(took_ms, [50, 99])
            row = {
                "rtt_ms": rtt_ms,
                "tcp_ms": round(measured_ms, 2),
                "ticks": len(took_ms),
                "tick_p50_ms": round(float(p50), 2),
                "tick_p99_ms": round(float(p99), 2),
                "hz": round(1e3 / float(p50), 1),
                "lost": lost,
            }
            console.print(row)
            rows.append(row)
    return rows


def draw(rows: list[dict[str, Any]], path: Path) -> None:
    """Write the picture; its kind follows from the file's name."""
    figure = Figure(figsize=(7, 4.5), layout="constrained")
    axes = figure.subplots()
    trips = [row["tcp_ms"] for row in rows]
    axes.plot(trips, [row["tick_p50_ms"] for row in rows], "o-", label="a tick, median")
    axes.plot(trips, [row["tick_p99_ms"] for row in rows], "^:", label="a tick, p99")
    axes.plot(trips, trips, "--", color="0.5", linewidth=1, label="one round trip")
    axes.axhline(REAL_TIME_MS, color="0.7", linewidth=1)
    axes.text(0.0, REAL_TIME_MS * 1.03, "real time", color="0.4", fontsize=8)
    axes.set(
        xlabel="round trip between the hosts, as TCP sees it [ms]",
        ylabel="ms",
        title="A: planner, motion, recorder; B: sim, SA",
    )
    axes.legend(fontsize=8)
    figure.savefig(path, dpi=150)


def table_of(rows: list[dict[str, Any]]) -> Table:
    """Lay the figures out for people."""
    table = Table(*rows[0])
    for row in rows:
        table.add_row(*map(str, row.values()))
    return table


def main() -> int:
    parser = argparse.ArgumentParser(prog="fras bench hosts", description=__doc__)
    parser.add_argument("--rtt", type=float, nargs="+", default=list(RTT_MS), metavar="MS")
    parser.add_argument("--trials", type=int, default=1, help="at each round-trip time")
    parser.add_argument("--json", type=Path, help="also write the figures there")
    parser.add_argument("--figure", type=Path, help="also draw them there")
    options = parser.parse_args()
    console = Console()
    try:
        rows = measure(options.rtt, options.trials, console)
    except NotPermitted as error:
        print(f"fras bench hosts: {error}", file=sys.stderr)
        return 3
    console.print(table_of(rows))
    if options.json:
        made = {"processor": processor(), "rows": rows}
        options.json.write_text(json.dumps(made, indent=2) + "\n")
    if options.figure:
        draw(rows, options.figure)
    return 0


if __name__ == "__main__":
    sys.exit(main())
