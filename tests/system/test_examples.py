"""The examples that need a trial: one hears it, the other reads its log."""

import re
import signal
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import tomlkit

from fras_supervisor import find_table

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_the_force_is_watched_from_another_process(
    trials: Any, wait_until: Callable[..., Any], tmp_path: Path
) -> None:
    said = tmp_path / "said.txt"
    endpoint, cell = trials.stack.link.connect, trials.stack.link.cell
    command = [sys.executable, str(EXAMPLES / "watch_force.py"), endpoint, cell]
    with said.open("w") as out:
        process = subprocess.Popen(command, stdout=out, stderr=subprocess.STDOUT)
    try:
        wait_until(lambda: "watching" in said.read_text(), "it listens")
        summary, _ = trials.run("b")
        wait_until(lambda: " soft " in said.read_text(), "a crossing")
    finally:
        process.send_signal(signal.SIGINT)
        status = process.wait(30)
    lines = said.read_text().splitlines()
    assert (status, lines[0], lines[-1]) == (0, "watching", "no longer")
    rows = [re.fullmatch(r"(\d\.\d{3}) N (ok|soft|hard) *(#*)", line) for line in lines[1:-1]]
    assert all(rows)
    forces_n = [float(row[1]) for row in rows if row]
    assert abs(max(forces_n) - summary.max_force_n) < 0.01
    assert max(len(row[3]) for row in rows if row) >= 40


def test_a_log_is_read_with_the_stock_reader(quiet: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / "read_log.py"), str(quiet)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert re.search(r"^trial trial-\d+, FRAS \S+, rules [0-9a-f]{12}$", done.stdout, re.MULTILINE)
    assert re.search(r"^plan: reach\(psm\d,b\(\d,\d\)\) → grasp", done.stdout, re.MULTILINE)
    assert re.search(r"^messages: motion \d+, ", done.stdout, re.MULTILINE)
    assert re.search(r"^pull\(psm\d\) +at most 0\.\d{3} N$", done.stdout, re.MULTILINE)


def test_a_trial_runs_with_the_smallest_bridge(tmp_path: Path) -> None:
    table = tomllib.loads(find_table("crtk").read_text(encoding="utf-8"))
    table["process"]["arms"] |= {
        "command": ["{python}", str(EXAMPLES / "bridge.py"), "{connect}", "{cell}"],
        "watchdog_s": 0.0,
    }
    mine = tmp_path / "mine.toml"
    mine.write_text(tomlkit.dumps(table), encoding="utf-8")
    command = ["run", "--compose", str(mine), "--mesh", "11,13,2", "--out", str(tmp_path / "out")]
    done = subprocess.run(
        [sys.executable, "-m", "fras_cli", *command, "--cell", "bridge-test"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "The region of interest is exposed." in done.stdout


def test_of_a_cut_log_the_stock_reader_tells_what_makes_it_whole(
    quiet: Path, tmp_path: Path
) -> None:
    whole = quiet / "audit.mcap" if quiet.is_dir() else quiet
    (tmp_path / "audit.mcap").write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / "read_log.py"), str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.strip().endswith("fras log recover makes it whole")
