"""What faults do to processes, links, disks and clocks, on processes of the test's own."""

import os
import signal
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from fras_experiments.chaos.clocked import FORMAT, LAUNCH, moved, set_clock
from fras_experiments.chaos.faults import VICTIMS, Fault
from fras_experiments.chaos.hands import Hands, NotThere
from fras_experiments.chaos.link import SlowLink
from fras_experiments.chaos.table import disturbed
from fras_supervisor import find_table, free_port, load_table

# Says how a line is answered: by its own clock, or by what became of a write.
ECHO = """
import sys, time
for line in sys.stdin:
    if line == "time\\n":
        print(time.time_ns(), flush=True)
    else:
        try:
            with open(line.strip(), "wb") as file:
                file.write(bytes(1000))
            print("written", flush=True)
        except OSError as error:
            print(error.strerror, flush=True)
"""


@pytest.fixture
def child() -> Iterator["subprocess.Popen[str]"]:
    command = [sys.executable, "-c", ECHO, "fras_recorder", "here"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True) as process:
        yield process
        process.kill()


def asked(child: "subprocess.Popen[str]", line: str) -> str:
    assert child.stdin is not None
    assert child.stdout is not None
    child.stdin.write(f"{line}\n")
    child.stdin.flush()
    return child.stdout.readline().strip()


@pytest.fixture
def hands() -> Hands:
    return Hands({"recorder": ("fras_recorder", "here")}, {}, {})


def fault(kind, amount: float = 0.0) -> Fault:
    return Fault(kind, "recorder", "pull/lift", 1, 0.0, 1.0, amount)


def test_a_kill_is_a_sigkill(child: "subprocess.Popen[str]", hands: Hands, tmp_path: Path):
    hands.do(fault("kill"), tmp_path / "audit.mcap")()
    assert child.wait(30.0) == -9
    with pytest.raises(NotThere):
        hands.do(fault("kill"), tmp_path / "audit.mcap")


def test_a_pause_ends(child: "subprocess.Popen[str]", hands: Hands, tmp_path: Path):
    go_on = hands.do(fault("pause"), tmp_path / "audit.mcap")
    stopped = os.waitid(os.P_PID, child.pid, os.WSTOPPED | os.WNOWAIT)
    assert stopped is not None
    assert stopped.si_status == signal.SIGSTOP
    go_on()
    assert asked(child, str(tmp_path / "file")) == "written"
    go_on = hands.do(fault("pause"), tmp_path / "audit.mcap")
    child.kill()
    child.wait(30.0)
    go_on()  # the watchdog was faster


def test_a_disk_is_full_until_it_is_mended(
    child: "subprocess.Popen[str]", hands: Hands, tmp_path: Path
):
    log = tmp_path / "audit.mcap"
    log.write_bytes(bytes(500))
    mend = hands.do(fault("disk", 400.0), log)
    assert asked(child, str(tmp_path / "file")) == "File too large"
    mend()
    assert asked(child, str(tmp_path / "file")) == "written"


def test_a_link_is_slow_for_a_while(tmp_path: Path):
    with SlowLink(free_port(), free_port()) as link:
        hands = Hands({}, {"recorder": link}, {})
        undo = hands.do(fault("delay", 0.02), tmp_path)
        assert link.delay_s == 0.02
        undo()
        assert link.delay_s == 0.0


def test_a_clock_jumps_under_a_process_that_runs(tmp_path: Path):
    clock = tmp_path / "clock"
    set_clock(clock, 0)
    (tmp_path / "echo.py").write_text(ECHO, encoding="utf-8")
    command = [sys.executable, "-c", LAUNCH, str(clock), "echo"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, cwd=tmp_path) as process:
        before_ns = int(asked(process, "time"))
        undo = Hands({}, {}, {"recorder": clock}).do(fault("clock", -3600.0), tmp_path)
        assert int(asked(process, "time")) < before_ns - 3000 * 10**9
        undo()
        assert int(asked(process, "time")) > before_ns
        process.kill()


def test_a_moved_clock_is_ahead_by_what_is_said():
    assert moved(lambda: 5, lambda: 7)() == 12
    assert FORMAT.unpack(FORMAT.pack(-(10**14))) == (-(10**14),)


def test_the_table_of_a_disturbed_stack_is_one(tmp_path: Path):
    text = find_table("local").read_text(encoding="utf-8")
    path = tmp_path / "table.toml"
    clock = tmp_path / "a{b}"
    path.write_text(disturbed(text, {"sim": "tcp/127.0.0.1:1"}, {"sa": clock}), encoding="utf-8")
    plain, table = load_table(find_table("local")), load_table(path)
    assert table.processes["sim"].command[-1] == "tcp/127.0.0.1:1"
    assert "{connect}" not in table.processes["sim"].command
    expected = ("{python}", "-c", LAUNCH, str(tmp_path / "a{{b}}"), "fras_sa")
    assert table.processes["sa"].command[:5] == expected
    assert table.processes["motion"].command == plain.processes["motion"].command
    for name in (*VICTIMS, "router"):
        one, other = plain.processes[name], table.processes[name]
        assert (one.backoff_s, one.watchdog_s, one.needs) == (
            *(other.backoff_s, other.watchdog_s, other.needs),
        )
    assert tomllib.loads(text)["process"].keys() == table.processes.keys()
