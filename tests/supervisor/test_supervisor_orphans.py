import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
import pytest

from fras_supervisor import free_port, guard_main
from fras_supervisor.guard import GuardDied, OrphanGuard

PARENT = Path(__file__).with_name("supervising_parent.py")
Eventually = Callable[[Callable[[], Any]], Any]
Gone = Callable[[int], bool]
StartParent = Callable[[dict[str, Any]], tuple[subprocess.Popen[str], dict[str, int]]]


@pytest.fixture
def start_parent(tmp_path: Path, write_table: Callable[[Any], str]) -> StartParent:
    """Starts a supervisor process; gives it and the ids of its children when all are ready."""

    def start(rows: dict[str, Any]) -> tuple[subprocess.Popen[str], dict[str, int]]:
        (tmp_path / "table.toml").write_text(write_table(rows))
        endpoint = f"tcp/127.0.0.1:{free_port()}"
        parent = subprocess.Popen(
            [sys.executable, PARENT, tmp_path / "table.toml", endpoint, tmp_path],
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        assert parent.stdout is not None
        return parent, json.loads(parent.stdout.readline())

    return start


def kill(parent: subprocess.Popen[str]) -> None:
    parent.kill()
    parent.communicate()


def test_children_of_a_killed_supervisor_end_by_themselves(
    start_parent: StartParent, eventually: Eventually, gone: Gone, ended: Callable[[], list[str]]
) -> None:
    parent, pids = start_parent({"router": {}, "sim": {"needs": ["router"]}})
    kill(parent)
    eventually(lambda: all(gone(pid) for pid in pids.values()))
    assert sorted(ended()) == ["router EOF", "sim EOF"]


def test_children_that_cannot_end_by_themselves_are_ended(
    start_parent: StartParent, eventually: Eventually, gone: Gone, tmp_path: Path
) -> None:
    stubborn = ["--deaf", "--ignore", "SIGINT", "SIGTERM"]
    parent, pids = start_parent(
        {
            "sim": {"does": stubborn, "stop_timeout_s": 0.3},
            "sa": {"does": ["--grandchild"], "stop_timeout_s": 0.3},
            "frozen": {"stop_timeout_s": 0.3},
        }
    )
    eventually((tmp_path / "ready.sa-child").exists)
    grandchild = int((tmp_path / "pid.sa-child").read_text())
    os.kill(pids["frozen"], signal.SIGSTOP)
    guard = [one.pid for one in psutil.Process(parent.pid).children()]
    kill(parent)
    everyone = {*pids.values(), grandchild, *guard}
    assert len(everyone) == 5
    eventually(lambda: all(gone(pid) for pid in everyone))


def test_ctrl_c_reaches_the_supervisor_alone_and_it_stops_them_in_order(
    start_parent: StartParent, gone: Gone, ended: Callable[[], list[str]]
) -> None:
    parent, pids = start_parent(
        {"router": {}, "sim": {"needs": ["router"]}, "sa": {"needs": ["sim"]}}
    )
    # What a terminal does: SIGINT to every process of the foreground group.
    os.killpg(parent.pid, signal.SIGINT)
    output, _ = parent.communicate(timeout=20)
    assert json.loads(output) == [["sa", "SIGINT"], ["sim", "SIGINT"], ["router", "SIGINT"]]
    assert ended() == ["sa SIGINT", "sim SIGINT", "router SIGINT"]
    assert parent.returncode == 0
    assert all(gone(pid) for pid in pids.values())


def run_guard(pids: list[int]) -> None:
    """Runs the guard to its end, as if its supervisor had died at once."""
    text = "".join(f"{pid}\n" for pid in pids)
    command = [sys.executable, "-I", "-S", guard_main.__file__, "0"]
    subprocess.run(command, input=text, text=True, check=True, timeout=20)


def test_guard_ends_its_charges_and_leaves_others_alone() -> None:
    with (
        subprocess.Popen(["sleep", "60"], start_new_session=True) as charge,
        subprocess.Popen(["sleep", "60"], start_new_session=True) as bystander,
    ):
        run_guard([charge.pid])
        assert charge.wait() == -signal.SIGKILL
        assert bystander.poll() is None
        bystander.kill()


def test_guard_spares_a_stranger_that_was_given_the_id_of_the_dead() -> None:
    with subprocess.Popen(["sleep", "60"], start_new_session=True) as stranger:
        started = guard_main.start_time(stranger.pid)
        assert guard_main.lives(stranger.pid, started)
        assert not guard_main.lives(stranger.pid, f"{started}0")
        stranger.kill()
    assert not guard_main.lives(stranger.pid, started)
    assert guard_main.start_time(stranger.pid) is None


def test_guard_ignores_the_dead() -> None:
    with subprocess.Popen(["true"], start_new_session=True) as process:
        process.wait()
    run_guard([process.pid])


def test_nothing_starts_without_the_guard(gone: Gone) -> None:
    guard = OrphanGuard(grace_s=0.0)
    os.kill(guard.pid, signal.SIGKILL)
    os.waitid(os.P_PID, guard.pid, os.WEXITED | os.WNOWAIT)
    with pytest.raises(GuardDied):
        guard.watch(os.getpid())
    guard.dismiss()
    assert gone(guard.pid)


def test_guard_outlives_signals_meant_for_the_supervisor(
    gone: Gone, eventually: Eventually
) -> None:
    guard = OrphanGuard(grace_s=0.0)

    numbers = {signal.SIGHUP, signal.SIGINT, signal.SIGTERM}

    def ignores_all() -> bool:
        status = Path(f"/proc/{guard.pid}/status").read_text()
        mask = int(status.split("SigIgn:")[1].split()[0], 16)
        return all(mask >> (number - 1) & 1 for number in numbers)

    eventually(ignores_all)
    for number in numbers:
        os.kill(guard.pid, number)
    guard.watch(os.getpid())
    assert not gone(guard.pid)
    guard.dismiss()
