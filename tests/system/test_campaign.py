"""`fras experiment` on real stacks: killed and resumed, with one worker and two, on a cluster."""

import csv
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psutil
import pytest

SIX = ["retraction", "--seeds", "2..4", "--mesh", "11,13,2"]
TWO = ["retraction", "--seeds", "2..2", "--mesh", "11,13,2"]
START = [*SIX, "--out", "r"]


def table(folder: Path) -> list[str]:
    return (folder / "trials.csv").read_text(encoding="utf-8").splitlines()


def kept(folder: Path) -> int:
    return len(list((folder / "records").glob("*.json")))


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of six trials on two workers, with all logs."""
    folder = tmp_path_factory.mktemp("campaign")
    command = [sys.executable, "-m", "fras_cli", "experiment", *START]
    options = ["--workers", "2", "--keep-logs", "all"]
    done = subprocess.run(
        [*command, *options], cwd=folder, capture_output=True, text=True, timeout=250, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "6 of 6 trials" in done.stdout
    assert not done.stderr, done.stderr
    return folder / "r"


def without_log(lines: list[str]) -> list[str]:
    """The column of the kept logs is the last one, and follows --keep-logs."""
    return [line.rpartition(",")[0] for line in lines]


def test_six_trials_on_two_workers_have_tables_series_and_logs(undisturbed: Path):
    lines = table(undisturbed)
    assert [line.split(",")[1] for line in lines] == ["trial", *"012345"]
    assert {line.split(",")[4] for line in lines[1:]} == {"true", "false"}
    assert all(",success," in line for line in lines[1:]), lines
    workers = {
        line.split(",")[1] for line in (undisturbed / "timing.csv").read_text().splitlines()[1:]
    }
    assert workers == {"0", "1"}
    for number in range(6):
        series = (undisturbed / "series" / f"{number}.csv").read_text().splitlines()
        assert len(series) > 5
        assert (undisturbed / "logs" / str(number) / "audit.mcap").stat().st_size > 10_000
    assert not (undisturbed / "scratch").exists()


def test_killed_in_the_middle_and_resumed_it_gives_the_same_table(
    undisturbed: Path, tmp_path: Path, fras: Callable[..., Any], wait_until: Any
):
    folder = tmp_path / "r"
    first = fras("experiment", *START)
    wait_until(lambda: kept(folder) >= 2, "two trials are kept")
    first.note_family()
    first.process.kill()
    first.end()
    wait_until(first.alone, "none of its processes is left")
    assert 2 <= kept(folder) < 6
    assert not (folder / "trials.csv").exists()
    times = {one: one.stat().st_mtime_ns for one in (folder / "records").glob("*.json")}
    second = fras("experiment", *START)
    assert second.end() == 0, second.text
    assert f"{len(times)} of them are there already" in second.text
    assert {one: one.stat().st_mtime_ns for one in times} == times
    assert without_log(table(folder)) == without_log(table(undisturbed))


def test_an_interrupt_ends_at_once_and_leaves_nothing_behind(
    tmp_path: Path, fras: Callable[..., Any], wait_until: Any
):
    command = fras("experiment", *START, "--workers", "2")
    wait_until(lambda: kept(tmp_path / "r") >= 1, "a trial is kept")
    command.note_family()
    # As at a terminal: each process of the group gets it.
    os.killpg(command.process.pid, signal.SIGINT)
    assert command.end() == 130, command.text
    wait_until(command.alone, "none of its processes is left")
    assert "goes on" in command.text
    assert "Traceback" not in command.text
    assert len(table(tmp_path / "r")) == 1 + kept(tmp_path / "r")


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextmanager
def dask(folder: Path, *arguments: str) -> Generator[subprocess.Popen[bytes]]:
    command = [sys.executable, "-m", "dask", *arguments]
    with (folder / f"{arguments[0]}.txt").open("wb") as sink:
        process = subprocess.Popen(
            command, cwd=folder, stdin=subprocess.DEVNULL, stdout=sink, stderr=sink
        )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
        process.wait(60)


def test_a_cluster_that_is_there_gives_the_same(
    undisturbed: Path, tmp_path: Path, fras: Callable[..., Any], wait_until: Any
):
    address = f"tcp://127.0.0.1:{(port := free_port())}"
    where = ["--scheduler", address]
    with (
        dask(tmp_path, "scheduler", "--port", str(port), "--no-dashboard") as scheduler,
        dask(tmp_path, "worker", address, "--nthreads", "1", "--no-dashboard") as worker,
    ):
        command = fras("experiment", *TWO, *where, "--out", "r")
        assert command.end() == 0, command.text
        assert without_log(table(tmp_path / "r")) == without_log(table(undisturbed)[:3])
        # The stack has gone with the campaign, the worker has not.
        assert worker.poll() is None

        def quiet() -> bool:
            family = psutil.Process(worker.pid).children(recursive=True)
            return not [one for one in family if "fras_sim" in " ".join(one.cmdline())]

        wait_until(quiet, "the worker's stack has gone")
        # In mid-campaign the scheduler dies.
        command = fras("experiment", *SIX, *where, "--out", "six")
        wait_until(lambda: kept(tmp_path / "six") >= 1, "a trial is kept")
        scheduler.kill()
        assert command.end() == 3, command.text
        assert "has gone" in command.text
        assert "Traceback" not in command.text
    folder = tmp_path / "six"
    assert len(table(folder)) == 1 + kept(folder)


UNTIL_PLAN = """
[campaign]
name = "plans"
seeds = "2..2"
until = "plan"
[set]
"tissue.node_counts" = [11, 13, 2]
[[cases]]
"awareness.blocks" = 5
[[cases]]
"awareness.blocks" = 6
"patient.young_modulus_factor" = 1.3
"""


def test_a_trial_until_its_plan_ends_there_with_a_patient_and_without(
    tmp_path: Path, fras: Callable[..., Any]
):
    (tmp_path / "plans.toml").write_text(UNTIL_PLAN, encoding="utf-8")
    command = fras("experiment", "plans.toml", "--out", "r")
    assert command.end() == 0, command.text
    assert "2 of 2 trials: 2 planned" in command.text
    with (tmp_path / "r" / "trials.csv").open(encoding="utf-8") as file:
        plain, twin = csv.DictReader(file)
    for row in (plain, twin):
        assert (row["outcome"], row["complete"], row["plans"]) == ("planned", "true", "1"), row
        # How far the arms had come is chance, and not told.
        assert row["ticks"] == row["visibility"] == row["patient_max_force_n"] == "", row
    assert (plain["patient.young_modulus_factor"], twin["awareness.blocks"]) == ("", "6")
    with (tmp_path / "r" / "timing.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            assert float(row["plan_service_s"]) > float(row["plan_first_s"]) > 0.0
            assert row["replan_move_s"] == row["replan_release_s"] == ""


def test_bad_input_is_named_before_anything_starts(
    undisturbed: Path, tmp_path: Path, fras_here: Callable[..., Any]
):
    before = table(undisturbed)
    dead = f"tcp://127.0.0.1:{free_port()}"
    for arguments, status, said in (
        (["nothing"], 2, "is neither a file nor one of: criteria"),
        ([*SIX[:3], "--out", str(undisturbed)], 2, "holds results of the campaign 'retraction'"),
        (["criteria", "--out", str(undisturbed)], 2, "those of 'criteria' are asked for"),
        (["retraction", "--seeds", "9..1"], 2, "the smaller one comes first: 1..9"),
        ([*TWO, "--scheduler", dead, "--out", "x"], 3, "no Dask scheduler answers"),
    ):
        command = fras_here("experiment", *arguments)
        assert command.status == status, command.text
        assert said in command.text, command.text
    assert table(undisturbed) == before
    told = fras_here("experiment", "--list")
    assert all(name in told.text for name in ("retraction", "criteria", "mesh", "faults"))
