import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fras_supervisor import StartCancelled, Unstoppable, shutdown

Make = Callable[..., Any]
Ended = Callable[[], list[str]]


def test_stops_in_reverse_order_with_sigint(make_stack: Make, ended: Ended) -> None:
    stack = make_stack(
        {
            "router": {},
            "recorder": {"needs": ["router"], "outlives": ["sim"]},
            "sim": {"needs": ["router"]},
            "sa": {"needs": ["sim"]},
        }
    )
    stack.start()
    exits = stack.stop()
    order = ["sa", "sim", "recorder", "router"]
    assert ended() == [f"{name} SIGINT" for name in order]
    assert list(exits) == order
    assert {(one.returncode, one.by) for one in exits.values()} == {(0, "SIGINT")}
    assert {one.state for one in stack.status()} == {"stopped"}
    assert stack.stop() == exits


def test_child_that_is_not_ready_yet_gets_sigterm(make_stack: Make, tmp_path: Path) -> None:
    # As one that loads its libraries: it would answer SIGINT with a traceback from any of them.
    started = tmp_path / "started"
    loads = f"import pathlib, signal; pathlib.Path({str(started)!r}).touch(); signal.pause()"
    stack = make_stack(
        {"sim": {"command": [sys.executable, "-c", loads]}}, cancelled=started.exists
    )
    with pytest.raises(StartCancelled):
        stack.start()
    exit_ = stack.stop()["sim"]
    assert (exit_.returncode, exit_.by, exit_.last_lines[1:]) == (-15, "SIGTERM", ())


def test_child_that_ignores_sigint_gets_sigterm(make_stack: Make, ended: Ended) -> None:
    stack = make_stack({"sim": {"does": ["--ignore", "SIGINT"], "stop_timeout_s": 0.2}})
    stack.start()
    exit_ = stack.stop()["sim"]
    assert (exit_.returncode, exit_.by) == (0, "SIGTERM")
    assert exit_.took_s >= 0.2
    assert ended() == ["sim SIGTERM"]


def test_child_that_ignores_both_is_killed_and_holds_up_only_those_it_needs(
    make_stack: Make, ended: Ended
) -> None:
    stack = make_stack(
        {
            "router": {},
            "sim": {
                "needs": ["router"],
                "does": ["--ignore", "SIGINT", "SIGTERM"],
                "stop_timeout_s": 0.2,
            },
            "sa": {"needs": ["router"]},
        }
    )
    stack.start()
    exits = stack.stop()
    assert (exits["sim"].returncode, exits["sim"].by) == (-9, "SIGKILL")
    assert exits["sim"].took_s >= 0.4
    assert list(exits) == ["sa", "sim", "router"]
    assert ended() == ["sa SIGINT", "router SIGINT"]


def test_frozen_child_is_woken_to_end_in_order(make_stack: Make, ended: Ended) -> None:
    stack = make_stack({"sim": {}})
    stack.start()
    os.kill(stack.status()[0].pid, signal.SIGSTOP)
    assert stack.stop()["sim"].by == "SIGINT"
    assert ended() == ["sim SIGINT"]


def test_stop_takes_along_what_a_child_left_behind(
    make_stack: Make, tmp_path: Path, eventually: Callable[[Any], Any], gone: Callable[[int], bool]
) -> None:
    stack = make_stack({"sim": {"does": ["--grandchild"]}})
    stack.start()
    eventually((tmp_path / "ready.sim-child").exists)
    grandchild = int((tmp_path / "pid.sim-child").read_text())
    assert not gone(grandchild)
    assert stack.stop()["sim"].by == "SIGINT"
    eventually(lambda: gone(grandchild))


def test_child_that_died_before_is_not_counted_as_stopped(make_stack: Make) -> None:
    stack = make_stack({"sim": {}, "sa": {}})
    stack.start()
    os.kill(stack.status()[0].pid, signal.SIGKILL)
    assert stack.watch(10)
    exits = stack.stop()
    assert (exits["sim"].by, exits["sa"].by) == ("itself", "SIGINT")


def test_stop_before_start_is_nothing(make_stack: Make) -> None:
    assert make_stack({"sim": {}}).stop() == {}


def test_with_statement_starts_and_stops(make_stack: Make, ended: Ended) -> None:
    with make_stack({"sim": {}}) as stack:
        assert stack.status()[0].state == "ready"
    assert ended() == ["sim SIGINT"]


def test_stopping_leaves_no_descriptor_open(make_stack: Make) -> None:
    def open_descriptors() -> int:
        return len(os.listdir("/proc/self/fd"))

    make_stack({"warm": {}}).start()
    before = open_descriptors()
    stack = make_stack({"sim": {}, "sa": {}})
    stack.start()
    stack.stop()
    assert open_descriptors() == before


class Immortal:
    """A child stuck in the kernel, which no test can make for real."""

    pid = 1
    has_started = True

    def __init__(self) -> None:
        self.sent: list[tuple[signal.Signals, float]] = []
        self.process = type("Row", (), {"stop_timeout_s": 0.0})

    def poll(self) -> None:
        return None

    def send(self, number: signal.Signals) -> None:
        self.sent.append((number, 0.0))

    def last_signal(self) -> tuple[signal.Signals, float] | None:
        return self.sent[-1] if self.sent else None


def test_process_that_outlives_sigkill_is_named() -> None:
    child: Any = Immortal()
    with pytest.raises(Unstoppable, match="sim") as caught:
        shutdown.shut_down({"sim": child}, {"sim": ()}, poll_s=0.0)
    assert caught.value.pids == {"sim": 1}
    assert [number for number, _ in child.sent] == [signal.SIGINT, signal.SIGTERM, signal.SIGKILL]
