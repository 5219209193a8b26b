"""Lets the faults of a trial happen at their ticks, from a thread of its own."""

import heapq
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Protocol, Self

from fras_common.bus import Bus
from fras_common.errors import FrasError
from fras_common.messages import RecorderStatus, RobotState
from fras_common.topics import RECORDER_STATUS, ROBOT_STATE
from fras_experiments.chaos.faults import Fault
from fras_experiments.chaos.hands import NotThere, Undo

RETRY_S = 0.05


class InjectorFailed(FrasError):
    """The thread that lets faults happen has ended by a mistake of ours."""


class Doer(Protocol):
    """Lets a fault happen; see `fras_experiments.chaos.hands.Hands`."""

    def do(self, fault: Fault, log: Path) -> Undo:
        """Do it, and return what takes it back."""
        ...


@dataclass
class Injected:
    """A fault, and when it happened and was taken back; 0 where it was not [ns]."""

    fault: Fault
    at_ns: int = 0
    until_ns: int = 0


@dataclass
class _Round:
    """What is to be done in one trial."""

    trial: str = ""
    log: Path = field(default_factory=Path)
    waiting: list[Injected] = field(default_factory=list[Injected])
    done: list[Injected] = field(default_factory=list[Injected])
    undo: dict[int, Undo] = field(default_factory=dict[int, Undo])


class Injector:
    """Waits for ticks, and does what is due.

    Parameters
    ----------
    bus : Bus
        On which the arms are heard.
    hands : Doer
    """

    def __init__(self, bus: Bus, hands: Doer) -> None:
        self._hands = hands
        self._changed = threading.Condition()
        self._round = _Round()
        self._due: list[tuple[float, int, Callable[[], None]]] = []
        self._numbers = count()
        self._ended = False
        self._failure: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="injector", daemon=True)
        bus.subscribe(ROBOT_STATE, self._on_robot)
        bus.subscribe(RECORDER_STATUS, self._on_recorder)

    def begin(self, trial: str, log: Path, faults: Sequence[Fault]) -> None:
        """Let faults happen from now on, in this trial alone."""
        with self._changed:
            self._round = _Round(trial, log, [Injected(fault) for fault in faults])

    def end(self) -> tuple[Injected, ...]:
        """Take back what lasts; tell what happened, and what the trial did not last for.

        Raises
        ------
        InjectorFailed
        """
        with self._changed:
            if self._failure is not None:
                raise InjectorFailed(f"a fault could not be done: {self._failure!r}")
            self._due.clear()
            for number in list(self._round.undo):
                self._undo(number)
            ended, self._round = self._round, _Round()
        return (*ended.done, *ended.waiting)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self.end()
        finally:
            with self._changed:
                self._ended = True
                self._changed.notify()
            self._thread.join()

    def _on_robot(self, state: RobotState) -> None:
        with self._changed:
            if state.trial != self._round.trial:
                return
            while self._round.waiting and state.tick >= self._round.waiting[0].fault.tick:
                one = self._round.waiting.pop(0)
                self._round.done.append(one)
                self._plan(one.fault.after_s, len(self._round.done) - 1)

    def _on_recorder(self, status: RecorderStatus) -> None:
        """Make room on a full disk once the recorder has said so: the log's end needs some."""
        if status.state != "error":
            return
        with self._changed:
            for number in list(self._round.undo):
                if self._round.done[number].fault.kind == "disk":
                    self._undo(number)

    def _plan(self, wait_s: float, number: int, undo: bool = False) -> None:
        job = (lambda: self._undo(number)) if undo else (lambda: self._do(number))
        heapq.heappush(self._due, (time.monotonic() + wait_s, next(self._numbers), job))
        self._changed.notify()

    def _run(self) -> None:
        with self._changed:
            try:
                self._wait_and_do()
            except Exception as error:  # noqa: BLE001 - raised again where somebody looks
                self._failure = error

    def _wait_and_do(self) -> None:
        while not self._ended:
            if not self._due:
                self._changed.wait()
            elif (wait_s := self._due[0][0] - time.monotonic()) > 0.0:
                self._changed.wait(wait_s)
            else:
                heapq.heappop(self._due)[2]()

    def _do(self, number: int) -> None:
        one = self._round.done[number]
        at_ns = time.time_ns()
        try:
            self._round.undo[number] = self._hands.do(one.fault, self._round.log)
        except NotThere:
            self._plan(RETRY_S, number)
            return
        one.at_ns = at_ns
        if one.fault.lasts_s > 0.0:
            self._plan(one.fault.lasts_s, number, undo=True)

    def _undo(self, number: int) -> None:
        self._round.undo.pop(number)()
        self._round.done[number].until_ns = time.time_ns()
