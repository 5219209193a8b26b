"""A recorder on a bus in memory, its loop in a thread, and someone who speaks to it."""

import threading
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
    Verdict,
)
from fras_common.messages import base as wire
from fras_common.messages.sim import SolverReport
from fras_common.scenario import Scenario
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

WAIT_S = 10.0
EMPTY = wire.Array(dtype="<f4", shape=(0, 3), data=b"")


class Stage:
    """A recorder with its loop in a thread, and someone who speaks to it."""

    def __init__(self) -> None:
        self.fabric = MemoryFabric()
        self.host = ServiceHost("recorder")
        self._own = MemoryBus(self.fabric, "test", "recorder/1")
        self.host.attach(self._own)
        self.speaker = MemoryBus(self.fabric, "test", "speaker/1")
        self.service = RecorderService(self.host)
        self._deliver = self.service._on_sample  # noqa: SLF001 - as the bus does
        self._loop = threading.Thread(target=self.host.run, args=(self.service.wake,))
        self._loop.start()
        topics: Any = (ROBOT_STATE, TISSUE_STATE, VERDICT, TASK_STATUS)
        self._publishers = {topic.key: self.speaker.publisher(topic) for topic in topics}
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

    def open(self, directory: Path, trial: str = "t-1", mesh: bytes = b"") -> ResetReply:
        request = OpenRequest(
            trial=trial, scenario=Scenario(seed=4), mesh=mesh, directory=str(directory)
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
        return MemoryBus(self.fabric, "test", source)

    def until_last(self, state: str) -> None:
        """Wait until the latest state is this one."""
        with self._changed:
            assert self._changed.wait_for(lambda: self.states[-1].state == state, WAIT_S)

    def settle(self) -> None:
        """Wait until everything said so far has been handled."""
        done = threading.Event()
        self.host.post(done.set)
        assert done.wait(WAIT_S)

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


def verdict(tick: int, trial: str) -> Verdict:
    return Verdict(
        tick=tick, trial=trial, level="ok", ok=True, reason="", max_force_n=0.0, limit_n=0.5,
        hard_limit_n=1.0, visibility=0.0, visible=False, max_height=[], force_rate_n_s=0.0,
        crossing_tick=-1, max_node_speed_m_s=0.0,
        grasped={},
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
