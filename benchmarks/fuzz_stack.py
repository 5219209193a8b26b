"""All services of a stack in one process, on a bus in memory, turned by hand."""

import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from fras_common.bus import MemoryBus, MemoryFabric, RawSample
from fras_common.messages import Fault, TaskRequest, TaskStatus
from fras_common.scenario import (
    AwarenessSection,
    PatientSection,
    PlannerSection,
    RunSection,
    Scenario,
    TissueSection,
    resolve,
)
from fras_common.service import Service, ServiceHost
from fras_common.topics import TASK, TASK_STATUS, Qos
from fras_motion.service import MotionService
from fras_planner.service import PlannerService
from fras_recorder.service import RecorderService
from fras_sa.service import AwarenessService
from fras_sim.service import SimService, patient_service

CELL: Final = "fuzz"
PATIENCE_S: Final = 60.0
SCENARIO: Final = resolve(
    Scenario(
        name="fuzz",
        seed=3,
        tissue=TissueSection(node_counts=(7, 9, 2)),
        awareness=AwarenessSection(blocks=5, no_limit=True),
        planner=PlannerSection(max_replans=1),
        patient=PatientSection(young_modulus_factor=1.3),
        run=RunSection(pace=0.0, hold_timeout_s=0.0),
    )
)


class Stack:
    """Six shells and a client.

    Parameters
    ----------
    folder : Path
        The only one below which logs may stand: who asks may ask for any.

    Attributes
    ----------
    now_s : float
        The clock by which the hosts say how often they may be asked.
    putting : bool
        Whether what is heard just now is what the client puts.
    """

    def __init__(self, folder: Path) -> None:
        shells: dict[str, Callable[[ServiceHost], Service]] = {
            "recorder": lambda host: RecorderService(host, below=folder, sign="no"),
            "sim": SimService,
            "patient": patient_service,
            "sa": AwarenessService,
            "motion": MotionService,
            "planner": PlannerService,
        }
        self.fabric = MemoryFabric()
        self.client = MemoryBus(self.fabric, CELL, "client/fuzz")
        self.now_s = 0.0
        self.hosts: dict[str, ServiceHost] = {}
        self.services: dict[str, Service] = {}
        for name, build in shells.items():
            host = self.hosts[name] = ServiceHost(name)
            host.clock = lambda: self.now_s
            host.attach(
                MemoryBus(self.fabric, CELL, f"{name}/f", on_malformed=host.count_malformed)
            )
            self.services[name] = build(host)
        for host in self.hosts.values():
            host.announce_alive()
        self.putting = False
        self.status: TaskStatus | None = None
        self.client.subscribe(TASK_STATUS, self._on_status)
        self.turn_until(lambda: all(one.state == "ready" for one in self.hosts.values()))

    def _on_status(self, status: TaskStatus) -> None:
        self.status = status

    def turn(self, rounds: int = 1_000_000) -> None:
        """Do all that is due, service by service, until nothing is or the rounds are over."""
        busy = True
        while busy and rounds > 0:
            busy, rounds = False, rounds - 1
            for name, host in self.hosts.items():
                self.services[name].wake()
                while host.drain(0.0):
                    busy = True
                    self.services[name].wake()

    def turn_until(self, condition: Callable[[], bool]) -> None:
        """Turn until a condition holds.

        Raises
        ------
        TimeoutError
        """
        until_s = time.monotonic() + PATIENCE_S
        while not condition():
            self.turn()
            # The recorder writes on a thread of its own.
            self.hosts["recorder"].drain(0.001)
            if time.monotonic() > until_s:
                raise TimeoutError(f"not within {PATIENCE_S} s; {self.status}")

    def start(self, trial: str, folder: Path) -> list[Any]:
        """Ask the planner to begin a trial; the list fills with its answer."""
        answers: list[Any] = []
        request = TaskRequest(
            command="start", trial=trial, scenario=SCENARIO, out_dir=str(folder.resolve())
        )
        self.client.ask(TASK, request, answers.append, PATIENCE_S)
        return answers

    def put(self, key: str, data: bytes) -> None:
        """Publish bytes on any key."""
        self.putting = True
        self.client.carry_as(Qos.COMMAND, RawSample(key, data, "application/msgpack"))
        self.putting = False

    def ask_raw(self, key: str, data: bytes) -> list[bytes | Fault]:
        """Ask a query with bytes; the list fills with what comes back."""
        answers: list[bytes | Fault] = []
        _, receive = self.fabric.servers[CELL, key]
        receive(data, answers.append)
        return answers

    def readers(self, key: str) -> int:
        """How many of the services decode what comes on a key."""
        return sum(
            entry.key_expr == key
            or (
                entry.key_expr.endswith("**")
                and entry.key_expr != "**"
                and key.startswith(entry.key_expr[:-2])
            )
            for entry in self.fabric.subscriptions[CELL]
            if entry.owner is not self.client
        )

    def hears(self, key: str) -> bool:
        """Whether a service reads what comes on a key, or answers a query (`?` and its key)."""
        return (CELL, key.removeprefix("?")) in self.fabric.servers or self.readers(key) > 0

    @property
    def malformed(self) -> int:
        """Payloads that the services have counted as malformed."""
        return sum(host.counts["malformed"] for host in self.hosts.values())

    def close(self) -> None:
        """Close the shells and leave the bus."""
        for name, host in self.hosts.items():
            self.services[name].close()
            host.bus.close()
        self.client.close()


@contextmanager
def stack(folder: Path) -> Generator[Stack]:
    """Have a stack for a while; see `Stack`."""
    made = Stack(folder)
    try:
        yield made
    finally:
        made.close()


Heard = dict[str, list[bytes]]


def run_trial(one: Stack, trial: str, folder: Path, meanwhile: Callable[[], None]) -> Heard:
    """Run a trial to its end; returns what was said on each key, requests of queries too."""
    heard: Heard = {}

    def hear(sample: RawSample) -> None:
        if not one.putting:
            heard.setdefault(sample.key, []).append(sample.payload)

    one.client.subscribe_raw("**", hear)
    answers = one.start(trial, folder)

    def ended() -> bool:
        meanwhile()
        status = one.status
        return status is not None and status.trial == trial and status.phase == "idle"

    one.turn_until(ended)
    if not answers or not answers[0].accepted:
        raise RuntimeError(f"the trial was not begun: {answers}")
    return heard
