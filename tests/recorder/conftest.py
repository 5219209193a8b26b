"""A recorder on a bus in memory, its loop in a thread, and someone who speaks to it."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from fras_common.bus import MemoryBus, MemoryFabric, RawSample
from fras_common.codec import encode
from fras_common.messages import (
    CloseRequest,
    Header,
    OpenRequest,
    RecorderStatus,
    ResetReply,
    RobotState,
    TaskStatus,
    TissueState,
)
from fras_common.messages import base as wire
from fras_common.messages.sim import SolverReport
from fras_common.scenario import Scenario
from fras_common.scenario.model import RecorderSection
from fras_common.service import ServiceHost
from fras_common.topics import (
    RECORDER_CLOSE,
    RECORDER_OPEN,
    RECORDER_STATUS,
    ROBOT_STATE,
    TASK_STATUS,
    TISSUE_STATE,
    VERDICT,
)
from fras_recorder.service import RecorderService
from support.verdicts import verdict

WAIT_S = 10.0
EMPTY = wire.Array(dtype="<f4", shape=(0, 3), data=b"")


class Stage:
    """A recorder with its loop in a thread, and someone who speaks to it."""

    def __init__(self, before: "Stage | None" = None) -> None:
        self.fabric = before.fabric if before is not None else MemoryFabric()
        # What the speakers' clocks are ahead of the recorder's.
        self.ahead_ns = 0
        self.host = ServiceHost("recorder")
        self._own = MemoryBus(self.fabric, "test", f"recorder/{2 if before else 1}")
        self.host.attach(self._own)
        self.speaker = before.speaker if before else MemoryBus(self.fabric, "test", "speaker/1")
        self.service = RecorderService(self.host)
        self._deliver = self.service._on_sample  # noqa: SLF001 - as the bus does
        self._loop = threading.Thread(target=self.host.run, args=(self.service.wake,))
        self._loop.start()
        topics: Any = (ROBOT_STATE, TISSUE_STATE, VERDICT, TASK_STATUS)
        self._publishers: dict[str, Any] = (
            before._publishers  # noqa: SLF001 - of the same kind
            if before is not None
            else {
                topic.key: self.other_bus(f"{topic.producer}/1").publisher(topic)
                for topic in topics
            }
        )
        self.states: list[RecorderStatus] = []
        self._changed = threading.Condition()
        self.speaker.subscribe(RECORDER_STATUS, self._on_state)

    def _on_state(self, status: RecorderStatus) -> None:
        with self._changed:
            self.states.append(status)
            self._changed.notify_all()

    def until(self, state: str) -> RecorderStatus:
        """Wait for a state of the recorder."""
        with self._changed:
            found = self._changed.wait_for(
                lambda: [status for status in self.states if status.state == state], WAIT_S
            )
        assert found, f"never {state}: {self.states}"
        return found[-1]

    def say(self, message: Header, key: str) -> Header:
        return self._publishers[key].put(message)

    def robot(self, tick: int, trial: str = "t-1") -> Header:
        return self.say(robot_state(tick, trial), "robot/state")

    def tissue(self, tick: int, trial: str = "t-1") -> Header:
        return self.say(tissue_state(tick, trial), "sim/tissue_state")

    def verdict(self, tick: int, trial: str = "t-1") -> Header:
        return self.say(verdict(tick, trial), "sa/verdict")

    def tick(self, number: int, trial: str = "t-1") -> None:
        self.robot(number, trial)
        self.tissue(number, trial)
        self.verdict(number, trial)

    def task(self, trial: str = "t-1") -> Header:
        """Say that the trial has ended."""
        return self.say(task_status(trial), "planner/task_status")

    def open(
        self,
        directory: Path,
        trial: str = "t-1",
        mesh: bytes = b"",
        rules: dict[str, str] | None = None,
        **recorder: Any,
    ) -> ResetReply:
        request = OpenRequest(
            trial=trial,
            scenario=Scenario(seed=4, recorder=RecorderSection(**recorder)),
            mesh=mesh,
            directory=str(directory),
            rules=rules or {},
        )
        return self.speaker.query(RECORDER_OPEN, request, WAIT_S)

    def ask_close(self, last_tick: int, status_seq: int, trial: str = "t-1") -> "Closing":
        closing = Closing()
        request = CloseRequest(trial=trial, last_tick=last_tick, status_seq=status_seq)
        self.speaker.ask(RECORDER_CLOSE, request, closing.settle, WAIT_S)
        return closing

    def arrive(self, message: Header, key: str) -> None:
        """Have a sample arrive as it is, with its own number and publisher."""
        self._deliver(RawSample(key, encode(message), "application/msgpack"))

    def other_bus(self, source: str) -> MemoryBus:
        """Another participant of the cell."""
        return MemoryBus(
            self.fabric, "test", source, clock_ns=lambda: time.time_ns() + self.ahead_ns
        )

    def until_last(self, state: str) -> None:
        """Wait until the latest state is this one."""
        with self._changed:
            assert self._changed.wait_for(lambda: self.states[-1].state == state, WAIT_S)

    def settle(self) -> None:
        """Wait until everything said so far has been written and handled."""
        for post in (self.service._writing._queue.put, self.host.post):  # noqa: SLF001
            done = threading.Event()
            post(done.set)
            assert done.wait(WAIT_S)

    def kill(self) -> "Stage":
        """End it as SIGKILL does, and start another one."""
        self.host.stop()
        self._loop.join(WAIT_S)
        writing = self.service._writing  # noqa: SLF001 - as the kernel does
        done = threading.Event()

        def vanish() -> None:
            log, writing._log = writing._log, None  # noqa: SLF001
            if log is not None:
                log.abandon()
            done.set()

        writing._queue.put(vanish)  # noqa: SLF001
        assert done.wait(WAIT_S)
        self._own.close()
        return Stage(self)

    def end(self) -> None:
        """End the process, as far as the recorder can tell; idempotent."""
        self.host.stop()
        self._loop.join(WAIT_S)
        assert not self._loop.is_alive()
        self.service.close()
        self._own.close()
        self.speaker.close()


class Closing:
    """The outcome of a close, when it comes."""

    def __init__(self) -> None:
        self._done = threading.Event()
        self.outcomes: list[Any] = []

    def settle(self, outcome: Any) -> None:
        self.outcomes.append(outcome)
        self._done.set()

    def wait(self, timeout_s: float = WAIT_S) -> Any:
        assert self._done.wait(timeout_s), "no answer"
        return self.outcomes[0]


def robot_state(tick: int, trial: str) -> RobotState:
    return RobotState(tick=tick, trial=trial, arms={}, action=None, holds={}, verdict_tick=tick - 1)


def tissue_state(tick: int, trial: str) -> TissueState:
    solver = SolverReport(
        iterations=1, residual=0.0, refactored=False, wall_s=0.0, converged=True,
        inverted_elements=0,
    )  # fmt: skip
    return TissueState(
        tick=tick, trial=trial, nodes_m=EMPTY, nodal_force_n=EMPTY, max_force_n=0.0,
        max_node_speed_m_s=0.0, tool_force_n={}, grasped={}, grasped_force_n={},
        patch_force_n=EMPTY, balance_residual_n=0.0, solver=solver,
    )  # fmt: skip


def task_status(trial: str = "t-1") -> TaskStatus:
    return TaskStatus(
        trial=trial, phase="ended", action="", goal_id="", tried=[], plans=1, replans=0,
        scenario_kind="A", actions=[], outcome="success", reason="",
        violations=[],
    )  # fmt: skip


@pytest.fixture
def stage() -> Iterator[Stage]:
    stage = Stage()
    yield stage
    stage.end()
