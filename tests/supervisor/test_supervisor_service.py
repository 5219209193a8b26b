"""The supervisor as a participant of its cell: what it says, takes, and asks of motion."""

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

from fras_common.bus import MemoryBus, MemoryFabric
from fras_common.errors import FrasError
from fras_common.messages import (
    Health,
    HoldRequest,
    HoldState,
    LogRecord,
    ProcessReport,
    RestartRequest,
    SupervisorStatus,
)
from fras_common.service import ServiceHost
from fras_common.service.logs import logger_to
from fras_common.topics import HEALTH, HOLD, LOG, RPC, SUPERVISOR_RESTART, SUPERVISOR_STATUS
from fras_supervisor import Stack
from fras_supervisor.service import SupervisorService

Eventually = Callable[[Callable[[], Any]], Any]
AGAIN = {"restart": "on-failure", "backoff_s": 0.05, "backoff_cap_s": 0.1}
FRAGILE = {**AGAIN, "restart_budget": 1}


class Busy(FrasError):
    pass


class Cell:
    """A supervisor's shell on a bus in memory, turned by hand, with a stack of small processes."""

    def __init__(self, stack: Stack, folder: Path, eventually: Eventually) -> None:
        self.stack = stack
        self._eventually = eventually
        self.fabric = fabric = MemoryFabric()
        self._buses = [MemoryBus(fabric, "test", name) for name in ("supervisor/1", "test/1")]
        self.bus = self._buses[1]
        self.statuses: list[SupervisorStatus] = []
        self.logs: list[LogRecord] = []
        self.holds: list[HoldRequest] = []
        self.refuse_holds = 0
        self.told: list[tuple[str, str]] = []
        self.bus.subscribe(SUPERVISOR_STATUS, self.statuses.append)
        self.bus.subscribe(LOG, self.logs.append)
        self.bus.serve(HOLD, self._on_hold)
        members = {name: MemoryBus(fabric, "test", f"{name}/1") for name in stack.table.processes}
        self._buses += members.values()
        self._health = {
            name: bus.publisher(HEALTH.of(service=name)) for name, bus in members.items()
        }
        self.host = ServiceHost("supervisor")
        self._file = (folder / "supervisor.txt").open("w")
        self.host.log = logger_to("supervisor", self._file, self.host.publish_log)
        self.host.attach(self._buses[0])
        stack.start()
        self.shell = SupervisorService(
            self.host, stack, lambda level, text: self.told.append((level, text))
        )

    def _on_hold(self, call: Any) -> None:
        self.holds.append(call.request)
        if len(self.holds) <= self.refuse_holds:
            call.fail(Busy("not now"))
        else:
            call.reply(HoldState(holds={call.request.holder: call.request.reason}, tick=7))

    def turn(self) -> None:
        self.shell.wake()
        while self.host.drain(0.0):
            pass

    def until(self, condition: Callable[[], Any]) -> Any:
        def reached() -> Any:
            self.turn()
            return condition()

        return self._eventually(reached)

    def of(self, name: str) -> ProcessReport:
        return next(one for one in self.statuses[-1].processes if one.name == name)

    def strike(self, name: str) -> None:
        os.kill(self.of(name).pid, signal.SIGKILL)

    def lose(self, name: str) -> None:
        """Let a process of one restart die twice."""
        self.until(lambda: self.statuses and self.of(name).state == "ready")
        self.strike(name)
        self.until(lambda: self.of(name).restarts == 1 and self.of(name).state == "ready")
        self.strike(name)
        self.until(lambda: self.of(name).state == "given_up")

    def beat(self, name: str, loop_lag_s: float = 0.0) -> None:
        self._health[name].put(
            Health(
                service=name, state="ready", rss_bytes=1, cpu_percent=0.0, received=0, published=0,
                malformed=0, refused=0, wrong_trial=0, queue_depth=0, queue_dropped=0, gaps=0,
                facts={}, loop_lag_s=loop_lag_s,
            )
        )  # fmt: skip

    def close(self) -> None:
        for bus in self._buses:
            bus.close()
        self._file.close()


@pytest.fixture
def cell(
    make_stack: Callable[..., Stack], tmp_path: Path, eventually: Eventually
) -> Iterator[Callable[..., Cell]]:
    made: list[Cell] = []

    def make(rows: dict[str, dict[str, Any]]) -> Cell:
        made.append(Cell(make_stack(rows, chance=lambda: 0.0), tmp_path, eventually))
        return made[-1]

    yield make
    for one in made:
        one.close()


def test_it_says_of_each_process_where_it_stands_and_what_it_uses(cell: Any) -> None:
    here = cell({"sim": AGAIN, "motion": AGAIN})
    here.until(lambda: here.statuses and here.of("sim").rss_bytes > 1_000_000)
    last = here.statuses[-1]
    assert (last.verdict, last.reason, last.held) == ("whole", "", False)
    assert [one.name for one in last.processes] == ["sim", "motion"]
    sim = here.of("sim")
    assert (sim.state, sim.restarts, sim.last_exit) == ("ready", 0, "")
    assert {one.pid for one in last.processes} == {one.pid for one in here.stack.status()}
    here.strike("sim")
    here.until(lambda: here.of("sim").state == "waiting")
    assert here.statuses[-1].verdict == "incomplete"
    assert "sim" in here.statuses[-1].reason
    assert (here.of("sim").pid, here.of("sim").rss_bytes) == (0, 0)
    here.until(lambda: here.of("sim").state == "ready")
    assert (here.of("sim").restarts, here.of("sim").last_exit) == (1, "by signal 9")
    assert [one.level for one in here.logs] == ["warning"]
    assert here.logs[0].fields["process"] == "sim"


def test_it_restarts_whom_it_is_told_to(cell: Any) -> None:
    here = cell({"sim": AGAIN, "motion": AGAIN})
    mirrors: list[Any] = []
    here.bus.subscribe(RPC, mirrors.append)
    answers: list[Any] = []
    here.until(lambda: here.statuses)
    pid = here.of("sim").pid
    request = RestartRequest(name="sim", by="cli")
    here.bus.ask(SUPERVISOR_RESTART, request, answers.append, 5.0)
    here.until(lambda: here.of("sim").restarts == 1 and here.of("sim").state == "ready")
    assert here.of("sim").pid != pid
    assert (answers[0].state, answers[0].restarts) == ("ready", 0)
    here.bus.ask(SUPERVISOR_RESTART, RestartRequest(name="x", by="cli"), answers.append, 5.0)
    here.until(lambda: len(answers) == 2)
    assert answers[1].remote_kind == "UnknownProcess"
    here.until(lambda: len(mirrors) == 2)
    assert msgspec.msgpack.decode(mirrors[0].request)["name"] == "sim"


def test_a_process_given_up_holds_the_arms_and_is_told_loudly(cell: Any) -> None:
    here = cell({"sim": FRAGILE, "motion": AGAIN})
    here.lose("sim")
    here.until(lambda: here.statuses[-1].held)
    assert [one.holder for one in here.holds] == ["supervisor"]
    assert "sim was given up" in here.holds[0].reason
    assert "1 times in 60 s" in here.holds[0].reason
    assert here.statuses[-1].verdict == "safe_hold"
    assert here.of("motion").state == "ready"
    loud = [text for level, text in here.told if level == "error"]
    assert "sim was given up" in loud[0]
    assert "motion holds the arms at tick 7" in loud[1]
    assert [one.level for one in here.logs].count("error") == 2
    # A motion that was started again is asked again.
    here.strike("motion")
    here.until(lambda: len(here.holds) == 2 and here.statuses[-1].held)
    # Once a person has it started again, nobody wants the hold any more; none lifts it either.
    here.bus.ask(SUPERVISOR_RESTART, RestartRequest(name="sim", by="cli"), lambda _: None, 5.0)
    here.until(lambda: here.statuses[-1].verdict == "whole")
    assert not here.statuses[-1].held
    assert len(here.holds) == 2


def test_a_hold_that_motion_does_not_acknowledge_is_asked_for_again(cell: Any) -> None:
    here = cell({"sim": FRAGILE, "motion": AGAIN})
    here.refuse_holds = 2
    here.lose("sim")
    here.until(lambda: here.statuses[-1].held)
    assert len(here.holds) == 3


def test_without_a_motion_nobody_is_asked(cell: Any) -> None:
    here = cell({"sim": AGAIN, "motion": FRAGILE})
    here.lose("motion")
    for _ in range(20):
        here.turn()
    assert here.holds == []
    assert (here.statuses[-1].verdict, here.statuses[-1].held) == ("safe_hold", False)


def test_one_that_is_heard_no_more_is_killed_and_comes_back(cell: Any) -> None:
    here = cell({"sim": {**AGAIN, "watchdog_s": 2.0}, "sa": AGAIN})
    here.until(lambda: here.statuses)

    def beaten() -> bool:
        here.beat("sa")
        return here.of("sim").restarts == 1

    here.until(beaten)
    assert "no sign of life for 2." in here.of("sim").last_exit
    assert here.of("sa").restarts == 0


def test_one_whose_loop_is_stuck_is_killed_though_it_is_heard(cell: Any) -> None:
    here = cell({"sim": {**AGAIN, "loop_watchdog_s": 2.0}, "sa": AGAIN})
    here.until(lambda: here.statuses)
    here.beat("sim", loop_lag_s=1.5)
    here.beat("sa", loop_lag_s=50.0)
    here.turn()
    assert here.of("sim").restarts == 0
    here.beat("sim", loop_lag_s=2.1)
    here.until(lambda: here.of("sim").restarts == 1)
    assert "its loop has not turned for 2.1 s" in here.of("sim").last_exit
    assert here.of("sa").restarts == 0


def test_one_that_takes_too_much_memory_is_killed(cell: Any) -> None:
    greedy = {**FRAGILE, "does": ["--fill-mb", "60"], "memory_limit_mb": 50}
    here = cell({"sim": greedy, "sa": {**AGAIN, "memory_limit_mb": 50}})
    here.until(lambda: here.statuses and here.of("sim").state == "given_up")
    assert "MB, above memory_limit_mb = 50" in here.of("sim").last_exit
    assert here.of("sa").restarts == 0


def test_motion_of_another_host_holds_the_arms_in_each_life_of_its(cell: Any) -> None:
    here = cell({"sim": FRAGILE})
    here.stack.table = msgspec.structs.replace(
        here.stack.table, here="B", elsewhere={"motion": "A"}
    )
    here.lose("sim")
    assert here.statuses[-1].host == "B"
    # Nobody is there to be asked, as while the link is lost.
    here.turn()
    assert here.holds == []
    motion = MemoryBus(here.fabric, "test", "motion/1")
    motion.announce("alive/motion")
    here.until(lambda: here.statuses[-1].held)
    assert [one.holder for one in here.holds] == ["supervisor"]
    motion.close()
    here.until(lambda: not here.host.present("alive/motion"))
    motion = MemoryBus(here.fabric, "test", "motion/2")
    motion.announce("alive/motion")
    here.until(lambda: len(here.holds) == 2)
    motion.close()
