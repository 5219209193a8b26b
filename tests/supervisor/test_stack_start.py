import json
import os
import socket
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fras_common.extras import MissingExtra
from fras_supervisor import (
    AlreadyStarted,
    BadEndpoint,
    CommandNotFound,
    Exit,
    LogDirUnusable,
    NotReady,
    PortTaken,
    ServiceDied,
    StartCancelled,
    TableError,
    extras,
)

Make = Callable[..., Any]
Gone = Callable[[int], bool]
ROUTER = {"does": ["--listen", "{connect}"], "readiness": "listening"}


def pids(folder: Path) -> list[int]:
    return [int(path.read_text()) for path in folder.glob("pid.*")]


def test_starts_in_order_of_need_and_waits_for_readiness(make_stack: Make) -> None:
    stack = make_stack(
        {
            "planner": {"needs": ["sim", "sa"]},
            "sa": {"needs": ["router"], "readiness": "alive", "does": ["--tell", "alive"]},
            "sim": {"needs": ["router"]},
            "router": ROUTER,
        }
    )
    assert {one.state for one in stack.status()} == {"pending"}
    stack.start()
    status = {one.name: one for one in stack.status()}
    assert [one.state for one in status.values()] == ["ready"] * 4
    after = {name: one.ready_after_s for name, one in status.items()}
    assert after["router"] < min(after["sim"], after["sa"])
    assert max(after["sim"], after["sa"]) < after["planner"]
    assert stack.watch() == ()


def test_independent_processes_start_side_by_side(make_stack: Make, tmp_path: Path) -> None:
    def alive() -> set[str]:
        # Neither is ready before both live, as services that wait for each other's messages.
        both = {"pid.sim", "pid.sa"} <= {path.name for path in tmp_path.glob("pid.*")}
        return {"ready/sim", "ready/sa"} if both else set()

    stack = make_stack({"sim": {}, "sa": {}}, alive=alive)
    stack.start()
    assert {one.state for one in stack.status()} == {"ready"}


def test_tokens_are_not_asked_for_before_the_router_listens(
    make_stack: Make, tokens: Callable[[], set[str]]
) -> None:
    states: list[str] = []

    def alive() -> set[str]:
        states.append(next(one.state for one in stack.status() if one.name == "router"))
        return tokens()

    stack = make_stack({"router": ROUTER, "sim": {"needs": ["router"]}}, alive=alive)
    stack.start()
    assert set(states) == {"ready"}


def test_death_at_start_is_named_with_the_last_lines_and_stops_the_rest(
    make_stack: Make, tmp_path: Path, gone: Gone
) -> None:
    stack = make_stack(
        {
            "router": ROUTER,
            "sim": {"does": ["--say", "no module named numba", "--die", "3"], "needs": ["router"]},
            "sa": {"does": ["--tell"], "needs": ["router"]},
        }
    )
    with pytest.raises(ServiceDied, match=r"sim died at start, with exit status 3") as caught:
        stack.start()
    assert (caught.value.name, caught.value.returncode) == ("sim", 3)
    assert caught.value.last_lines == ("no module named numba",)
    assert "no module named numba" in str(caught.value)
    assert all(gone(pid) for pid in pids(tmp_path))
    assert "no module named numba" in (tmp_path / "logs" / "sim.log").read_text()


def test_ready_process_that_dies_while_others_start_is_a_death_at_start(
    make_stack: Make, tokens: Callable[[], set[str]], tmp_path: Path
) -> None:
    def alive() -> set[str]:
        told = tokens()
        if "ready/sim" in told:
            os.kill(int((tmp_path / "pid.sim").read_text()), 9)
        return told

    stack = make_stack({"sim": {}, "sa": {"does": ["--tell"]}}, alive=alive)
    with pytest.raises(ServiceDied, match="by signal 9") as caught:
        stack.start()
    assert (caught.value.name, caught.value.returncode) == ("sim", -9)


def test_process_that_never_becomes_ready_is_named(
    make_stack: Make, tmp_path: Path, gone: Gone
) -> None:
    stack = make_stack(
        {
            "sa": {},
            "sim": {"does": ["--tell", "--mutter", "compiling 3 %"], "ready_timeout_s": 0.5},
        }
    )
    with pytest.raises(NotReady) as caught:
        stack.start()
    assert caught.value.name == "sim"
    assert caught.value.waited_s >= 0.5
    assert caught.value.last_lines == ("compiling 3 %",)
    assert "sim" in caught.value.waiting
    assert all(gone(pid) for pid in pids(tmp_path))


def test_taken_port_is_named_before_anything_starts(make_stack: Make, tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        stack = make_stack({"sim": {}, "router": ROUTER}, connect=f"tcp/127.0.0.1:{port}")
        with pytest.raises(PortTaken) as caught:
            stack.start()
    assert caught.value.port == port
    assert not (tmp_path / "logs").exists()
    stack.start()
    assert {one.state for one in stack.status()} == {"ready"}


def test_unknown_program_is_named_before_anything_starts(make_stack: Make) -> None:
    with pytest.raises(CommandNotFound, match="no-such-program") as caught:
        make_stack({"sim": {}, "sa": {"command": ["no-such-program"]}})
    assert (caught.value.name, caught.value.command) == ("sa", "no-such-program")


def test_program_that_cannot_be_executed_stops_the_rest(
    make_stack: Make, tmp_path: Path, gone: Gone
) -> None:
    broken = tmp_path / "broken"
    broken.write_text("no interpreter line")
    broken.chmod(0o755)
    stack = make_stack({"sim": {}, "sa": {"command": [str(broken)], "needs": ["sim"]}})
    with pytest.raises(CommandNotFound, match="Exec format error"):
        stack.start()
    assert all(gone(pid) for pid in pids(tmp_path))


def test_folder_of_logs_that_cannot_be_made_is_named(make_stack: Make, tmp_path: Path) -> None:
    (tmp_path / "logs").write_text("a file")
    with pytest.raises(LogDirUnusable):
        make_stack({"sim": {}}).start()
    assert pids(tmp_path) == []


def test_a_host_that_is_not_this_one_is_refused_and_not_ignored(make_stack: Make) -> None:
    with pytest.raises(TableError, match="`fras up --host B`") as caught:
        make_stack({"sim": {"host": "B"}})
    assert caught.value.key == "process.sim.host"
    make_stack({"sim": {"host": socket.gethostname()}}).start()


def test_a_missing_library_is_named_before_anything_starts(
    make_stack: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(extras, "is_installed", lambda library: library != "clingo")
    planner = {"command": ["{python}", "-m", "fras_planner"]}
    with pytest.raises(MissingExtra, match=r"process planner .*'clingo'.*fras\[planner\]"):
        make_stack({"sim": {}, "planner": planner})
    assert pids(tmp_path) == []


def test_bad_endpoint_is_refused(make_stack: Make) -> None:
    with pytest.raises(BadEndpoint):
        make_stack({"sim": {}}, connect="localhost:7447")


def test_placeholders_of_the_caller_are_filled_in(make_stack: Make, tmp_path: Path) -> None:
    stack = make_stack({"sim": {"does": ["--say", "{out}|{cell}"]}}, values={"out": "/o"})
    stack.start()
    stack.stop()
    assert "\n/o|test\n" in (tmp_path / "logs" / "sim.log").read_text()


def test_start_can_be_cancelled(make_stack: Make, tmp_path: Path, gone: Gone) -> None:
    stack = make_stack(
        {"sim": {"does": ["--tell"]}}, cancelled=lambda: (tmp_path / "pid.sim").exists()
    )
    with pytest.raises(StartCancelled, match="sim"):
        stack.start()
    assert all(gone(pid) for pid in pids(tmp_path))


def test_an_interrupt_while_starting_stops_everything(
    make_stack: Make, tmp_path: Path, gone: Gone
) -> None:
    def alive() -> set[str]:
        if pids(tmp_path):
            raise KeyboardInterrupt
        return set()

    with pytest.raises(KeyboardInterrupt):
        make_stack({"sim": {"does": ["--tell"]}}, alive=alive).start()
    assert all(gone(pid) for pid in pids(tmp_path))


def test_a_stack_starts_once(make_stack: Make) -> None:
    stack = make_stack({"sim": {}})
    stack.start()
    with pytest.raises(AlreadyStarted):
        stack.start()


def test_watch_returns_the_dead_with_their_last_lines(make_stack: Make, tmp_path: Path) -> None:
    stack = make_stack({"sim": {"does": ["--say", "tick 7"]}, "sa": {}})
    stack.start()
    os.kill(int((tmp_path / "pid.sim").read_text()), 9)
    (dead,) = stack.watch(10)
    assert dead == Exit("sim", -9, "itself", 0.0, ("tick 7",))
    assert {one.name: one.state for one in stack.status()} == {"sim": "given_up", "sa": "ready"}
    assert stack.stop()["sim"] is dead


def test_children_get_the_environment_of_a_repeatable_trial(
    make_stack: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "8")
    monkeypatch.setenv("KEPT", "yes")
    make_stack({"sim": {"does": ["--environment"]}}).start()
    environment = json.loads((tmp_path / "environment.sim").read_text())
    wanted = {
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        "MKL_NUM_THREADS": "1",
        "MKL_CBWR": "COMPATIBLE",
        "NUMBA_NUM_THREADS": "1",
        "PYTHONUNBUFFERED": "1",
        "FRAS_PARENT": "stdin",
        "KEPT": "yes",
    }
    assert wanted.items() <= environment.items()


def test_children_are_out_of_reach_of_the_terminal(make_stack: Make) -> None:
    stack = make_stack({"sim": {}, "sa": {}})
    stack.start()
    for one in stack.status():
        assert os.getpgid(one.pid) == os.getsid(one.pid) == one.pid
        assert os.getsid(one.pid) != os.getsid(0)


def test_flood_of_output_neither_blocks_the_child_nor_fills_the_disk(
    make_stack: Make, tmp_path: Path
) -> None:
    heard: list[str] = []
    stack = make_stack(
        {"sim": {"does": ["--flood-lines", "250000"]}},
        echo=lambda name, line: heard.append(name + line),
    )
    stack.start()
    stack.stop()
    files = sorted((tmp_path / "logs").iterdir())
    assert [one.name for one in files] == ["sim.log", "sim.log.1", "sim.log.2"]
    assert max(one.stat().st_size for one in files) <= 5_000_000
    assert files[0].read_text().splitlines()[-1].startswith("line 0249999 ")
    assert len(heard) == 250_000
    assert heard[-1].startswith("simline 0249999 ")


def test_log_begins_with_the_command(make_stack: Make, tmp_path: Path) -> None:
    make_stack({"sim": {}}).start()
    first = (tmp_path / "logs" / "sim.log").read_text().splitlines()[0]
    assert first.startswith("[supervisor] 20")
    assert sys.executable in first
