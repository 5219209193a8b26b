"""A stack of small processes that die: who comes back, when, and who does not."""

import os
import resource
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
import pytest

from fras_supervisor import LimitRefused, Stack, StartCancelled, UnknownProcess

Make = Callable[..., Stack]
Eventually = Callable[[Callable[[], Any]], Any]
Gone = Callable[[int], bool]

AGAIN = {"restart": "on-failure", "backoff_s": 0.05, "backoff_cap_s": 0.4}
ROUTER = {"does": ["--listen", "{connect}"], "readiness": "listening", **AGAIN}


class Kept:
    """A stack that has started, turned by hand."""

    def __init__(self, stack: Stack, eventually: Eventually) -> None:
        self.stack = stack
        self.told: list[str] = []
        self._eventually = eventually
        stack.start()

    def turn(self) -> None:
        self.told += [f"{one.name} {one.text}" for one in self.stack.turn()]

    def of(self, name: str) -> Any:
        return next(one for one in self.stack.status() if one.name == name)

    def until(self, name: str, state: str) -> Any:
        def reached() -> bool:
            self.turn()
            return self.of(name).state == state

        self._eventually(reached)
        return self.of(name)

    def strike(self, name: str, number: int = signal.SIGKILL) -> int:
        pid = self.of(name).pid
        os.kill(pid, number)
        return pid


@pytest.fixture
def keep(make_stack: Make, eventually: Eventually) -> Callable[..., Kept]:
    def made(rows: dict[str, dict[str, Any]], **options: Any) -> Kept:
        return Kept(make_stack(rows, chance=lambda: 0.0, **options), eventually)

    return made


def test_what_is_killed_comes_back_ready_with_a_new_id(keep: Callable[..., Kept]) -> None:
    kept = keep({"sim": AGAIN, "sa": AGAIN})
    before = {name: kept.of(name).pid for name in ("sim", "sa")}
    kept.strike("sim")
    kept.until("sim", "waiting")
    after = kept.until("sim", "ready")
    assert after.pid != before["sim"]
    assert (after.restarts, after.last_exit) == (1, "by signal 9")
    assert (kept.of("sa").pid, kept.of("sa").restarts) == (before["sa"], 0)
    assert kept.told[0].startswith("sim ended by signal 9: starts again in 0.1 s (restart 1 of 5")
    assert kept.stack.gone() == ()


def test_its_log_goes_on_in_the_same_file(keep: Callable[..., Kept]) -> None:
    kept = keep({"sim": {**AGAIN, "does": ["--say", "hello"]}})
    kept.strike("sim")
    kept.until("sim", "waiting")
    kept.until("sim", "ready")
    kept.stack.stop()
    assert (kept.of("sim").log).read_text().count("\nhello\n") == 2


def test_over_its_budget_it_is_given_up_and_the_rest_runs_on(
    keep: Callable[..., Kept], tmp_path: Path
) -> None:
    rows = {"sim": {**AGAIN, "restart_budget": 2}, "sa": AGAIN}
    kept = keep(rows)
    for _ in range(2):
        kept.strike("sim")
        kept.until("sim", "waiting")
        kept.until("sim", "ready")
    kept.strike("sim")
    lost = kept.until("sim", "given_up")
    assert "2 times in 60 s" in lost.reason
    assert [one.name for one in kept.stack.gone()] == ["sim"]
    assert kept.of("sa").state == "ready"
    assert len((tmp_path / "lives.sim").read_text()) == 3
    # A person may try once more, and what counted against it is forgotten.
    kept.stack.restart("sim")
    assert kept.until("sim", "ready").restarts == 3
    kept.strike("sim")
    kept.until("sim", "waiting")
    assert kept.until("sim", "ready").restarts == 4
    assert kept.stack.gone() == ()


def test_one_that_says_it_cannot_start_is_tried_once_more(keep: Callable[..., Kept]) -> None:
    kept = keep({"sim": AGAIN, "sa": {**AGAIN, "does": ["--die", "3", "--die-after", "1"]}})
    kept.strike("sa")
    lost = kept.until("sa", "given_up")
    assert lost.last_exit == "with exit status 3"
    assert lost.restarts == 2


def test_one_that_ends_in_order_stays_ended(keep: Callable[..., Kept]) -> None:
    kept = keep({"sim": AGAIN, "sa": {**AGAIN, "restart": "always"}})
    kept.strike("sim", signal.SIGTERM)
    kept.strike("sa", signal.SIGTERM)
    assert kept.until("sim", "ended").last_exit == "with exit status 0"
    kept.until("sa", "waiting")
    kept.until("sa", "ready")
    assert [one.name for one in kept.stack.gone()] == ["sim"]


def test_a_process_waits_for_what_it_needs(keep: Callable[..., Kept], tmp_path: Path) -> None:
    slow = {**ROUTER, "backoff_s": 0.4}
    kept = keep({"router": slow, "sim": {**AGAIN, "needs": ["router"]}, "sa": AGAIN})
    sa = kept.of("sa").pid
    kept.strike("router")
    kept.until("router", "waiting")
    kept.strike("sim")
    kept.until("sim", "waiting")
    while kept.of("router").state != "ready":
        assert kept.of("sim").state == "waiting"
        kept.turn()
        time.sleep(0.005)  # the interval between two turns
    kept.until("sim", "ready")
    assert kept.of("sa").pid == sa
    assert kept.of("router").restarts == kept.of("sim").restarts == 1


def test_what_is_not_ready_in_time_is_killed_and_tried_again(
    keep: Callable[..., Kept], tmp_path: Path, tokens: Callable[[], set[str]]
) -> None:
    def alive() -> set[str]:
        # Its second life does not become ready.
        lives = (
            len((tmp_path / "lives.sim").read_text()) if (tmp_path / "lives.sim").exists() else 0
        )
        return set() if lives == 2 else tokens()

    kept = keep({"sim": {**AGAIN, "ready_timeout_s": 1.0}}, alive=alive)
    kept.strike("sim")
    kept.until("sim", "waiting")
    kept.until("sim", "ready")
    assert len((tmp_path / "lives.sim").read_text()) == 3
    assert any("killed: not ready after 1." in line for line in kept.told)


def test_a_token_that_its_last_life_left_does_not_make_it_ready(
    keep: Callable[..., Kept], tokens: Callable[[], set[str]]
) -> None:
    left: set[str] = set()
    kept = keep({"sim": AGAIN}, alive=lambda: tokens() | left)
    left.add("ready/sim")
    kept.strike("sim")
    kept.until("sim", "starting")
    for _ in range(50):
        kept.turn()
    assert kept.of("sim").state == "starting"
    left.clear()
    kept.until("sim", "ready")


def test_a_restart_that_is_ordered_is_one_in_order(
    keep: Callable[..., Kept], ended: Callable[[], list[str]]
) -> None:
    kept = keep({"sim": {**AGAIN, "restart": "never"}, "sa": AGAIN})
    pid = kept.of("sim").pid
    kept.stack.restart("sim")
    kept.until("sim", "starting")
    assert kept.until("sim", "ready").pid != pid
    assert ended() == ["sim SIGINT"]
    with pytest.raises(UnknownProcess, match=r"'nobody'.*sim, sa"):
        kept.stack.restart("nobody")


def test_one_that_does_not_end_when_ordered_is_killed_and_starts_again(
    keep: Callable[..., Kept],
) -> None:
    deaf = {**AGAIN, "does": ["--ignore", "SIGINT", "SIGTERM"], "stop_timeout_s": 0.2}
    kept = keep({"sim": deaf})
    pid = kept.of("sim").pid
    kept.stack.restart("sim")
    kept.until("sim", "starting")
    assert kept.until("sim", "ready").pid != pid


def test_a_kill_is_a_failure_and_its_reason_is_told(keep: Callable[..., Kept]) -> None:
    kept = keep({"sim": AGAIN})
    kept.strike("sim", signal.SIGSTOP)
    kept.stack.kill("sim", "no sign of life for 5.0 s")
    kept.until("sim", "waiting")
    assert kept.until("sim", "ready").last_exit == "by signal 9 (no sign of life for 5.0 s)"


def test_who_dies_while_the_stack_stops_is_not_started_again(
    keep: Callable[..., Kept], tmp_path: Path, eventually: Eventually, gone: Gone
) -> None:
    always = {**AGAIN, "restart": "always"}
    kept = keep({"sim": always, "sa": {**always, "needs": ["sim"], "does": ["--linger"]}})
    exits: dict[str, Any] = {}
    stopping = threading.Thread(target=lambda: exits.update(kept.stack.stop()))
    stopping.start()
    # One takes its time; the other, which is asked after it, dies meanwhile.
    eventually((tmp_path / "ending.sa").exists)
    pid = kept.strike("sim")
    eventually(lambda: gone(pid))
    (tmp_path / "go").touch()
    stopping.join()
    assert (exits["sim"].returncode, exits["sa"].returncode) == (-9, 0)
    assert len((tmp_path / "lives.sim").read_text()) == 1
    assert {one.state for one in kept.stack.status()} == {"stopped"}


def test_after_a_cancelled_start_nothing_is_launched_any_more(
    make_stack: Make, tmp_path: Path
) -> None:
    rows = {"sim": {"does": ["--tell"]}, "sa": {}, "motion": {"needs": ["sa", "sim"]}}
    stack = make_stack(rows, cancelled=(tmp_path / "ready.sa").exists)
    with pytest.raises(StartCancelled):
        stack.start()
    before = {one.name: one.pid for one in stack.status()}
    for name in rows:
        stack.restart(name)
    assert stack.turn() == []
    assert {one.name: one.pid for one in stack.status()} == before
    assert before["motion"] is None


def test_what_waits_for_its_next_start_does_not_start_in_the_stop(
    keep: Callable[..., Kept], tmp_path: Path
) -> None:
    kept = keep({"sim": {**AGAIN, "backoff_s": 0.1, "backoff_cap_s": 0.1}, "sa": AGAIN})
    kept.strike("sim")
    kept.until("sim", "waiting")
    kept.stack.stop()
    due_at_s = time.monotonic() + 0.2
    while time.monotonic() < due_at_s:  # its back-off ends in between
        kept.turn()
    assert len((tmp_path / "lives.sim").read_text()) == 1


def test_files_and_niceness_are_limited(keep: Callable[..., Kept]) -> None:
    kept = keep({"sim": {**AGAIN, "open_files_limit": 100, "nice": 3}, "sa": AGAIN})
    mine = os.getpriority(os.PRIO_PROCESS, 0)
    for _ in range(2):
        one = psutil.Process(kept.of("sim").pid)
        assert one.rlimit(psutil.RLIMIT_NOFILE) == (100, 100)
        assert one.nice() == mine + 3
        kept.strike("sim")
        kept.until("sim", "waiting")
        kept.until("sim", "ready")
    other = psutil.Process(kept.of("sa").pid)
    assert other.rlimit(psutil.RLIMIT_NOFILE) == resource.getrlimit(resource.RLIMIT_NOFILE)
    assert other.nice() == mine


def test_a_limit_that_the_system_refuses_is_named(make_stack: Make, monkeypatch: Any) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    # As root everything may be set.
    monkeypatch.setattr(os, "setpriority", refuse)
    with pytest.raises(LimitRefused, match="nice = -5 can't be set"):
        make_stack({"sim": {"nice": -5}}).start()


def test_a_guard_that_somebody_killed_is_replaced(
    keep: Callable[..., Kept], eventually: Eventually
) -> None:
    def guards() -> list[int]:
        children = psutil.Process().children()
        living = (one for one in children if one.status() != psutil.STATUS_ZOMBIE)
        return [one.pid for one in living if any("guard_main" in word for word in one.cmdline())]

    before = set(guards())
    kept = keep({"sim": AGAIN, "sa": AGAIN})
    (guard,) = set(guards()) - before
    os.kill(guard, signal.SIGKILL)

    def replaced() -> bool:
        kept.turn()
        return len(set(guards()) - before - {guard}) == 1

    eventually(replaced)
    kept.strike("sim")
    kept.until("sim", "waiting")
    kept.until("sim", "ready")
    kept.stack.stop()
    assert set(guards()) == before


def test_a_program_that_has_gone_is_given_up(keep: Callable[..., Kept], tmp_path: Path) -> None:
    program = tmp_path / "program"
    program.write_text("#!/bin/sh\nexec sleep 60\n")
    program.chmod(0o755)
    rows = {"sim": {**AGAIN, "command": [str(program)]}, "sa": AGAIN}
    kept = keep(rows, alive=lambda: {"ready/sim", "ready/sa"})
    program.unlink()
    kept.strike("sim")
    assert "can't be run" in kept.until("sim", "given_up").reason
    assert kept.of("sa").state == "ready"
