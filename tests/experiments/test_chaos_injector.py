"""Faults happen at their ticks, once, and are taken back."""

import threading
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from fras_common.bus import MemoryBus, MemoryFabric
from fras_common.messages import RecorderStatus
from fras_common.topics import RECORDER_STATUS, ROBOT_STATE
from fras_experiments.chaos.faults import Fault
from fras_experiments.chaos.hands import NotThere
from fras_experiments.chaos.injector import Injector, InjectorFailed
from support.robots import robot

WAIT_S = 30.0


class Noted:
    """Notes what is to be done, in the place of hands."""

    def __init__(self, away: int = 0, mistake: bool = False) -> None:
        self.told: list[str] = []
        self._changed = threading.Condition()
        self._away = away
        self._mistake = mistake

    def note(self, what: str) -> None:
        with self._changed:
            self.told.append(what)
            self._changed.notify_all()

    def do(self, fault: Fault, log: Path) -> Callable[[], None]:
        self._away -= 1
        if self._away >= 0:
            raise NotThere("not now", victim=fault.victim)
        self.note(f"{fault.kind} {fault.tick}")
        if self._mistake:
            raise ZeroDivisionError
        return lambda: self.note(f"undo {fault.kind}")

    def until(self, *told: str) -> None:
        with self._changed:
            assert self._changed.wait_for(lambda: self.told == list(told), WAIT_S), self.told


def fault(kind, tick: int, lasts_s: float = 0.0) -> Fault:
    return Fault(kind, "sim", "pull/lift", tick, 0.0, lasts_s)


def status(state) -> RecorderStatus:
    return RecorderStatus(state=state, path="", messages=0, bytes=0, lost=0, reason="")


class Motion:
    """Says where the arms are."""

    def __init__(self, fabric: MemoryFabric) -> None:
        self._fabric = fabric
        self._publisher = self.bus("motion/1").publisher(ROBOT_STATE)

    def bus(self, source: str) -> MemoryBus:
        return MemoryBus(self._fabric, "cell", source)

    def __call__(self, tick: int, trial: str = "t") -> None:
        self._publisher.put(robot(tick, trial=trial))


@pytest.fixture
def arms() -> tuple[MemoryBus, Motion]:
    """A bus, and motion that speaks on it."""
    motion = Motion(MemoryFabric())
    return motion.bus("cli/1"), motion


def test_each_happens_at_its_tick_or_the_first_one_after(arms: Any, tmp_path: Path):
    bus, say = arms
    hands = Noted()
    with Injector(bus, hands) as injector:
        injector.begin("t", tmp_path, [fault("kill", 3), fault("clock", 5), fault("pause", 90)])
        say(50, trial="another")
        say(2)
        say(4)
        hands.until("kill 3")
        say(4)
        say(6)
        hands.until("kill 3", "clock 5")
        kill, clock, pause = injector.end()
        assert hands.told[2:] == ["undo kill", "undo clock"]
        assert 0 < kill.at_ns <= clock.at_ns <= clock.until_ns
        assert pause.at_ns == 0
        say(95)
        assert injector.end() == ()


def test_what_lasts_is_taken_back_in_time_and_not_again(arms: Any, tmp_path: Path):
    bus, say = arms
    hands = Noted()
    with Injector(bus, hands) as injector:
        injector.begin("t", tmp_path, [fault("pause", 1, lasts_s=0.01)])
        say(1)
        hands.until("pause 1", "undo pause")
        injector.end()
        hands.until("pause 1", "undo pause")


def test_who_is_away_is_met_when_it_is_back(arms: Any, tmp_path: Path):
    bus, say = arms
    hands = Noted(away=2)
    with Injector(bus, hands) as injector:
        injector.begin("t", tmp_path, [fault("kill", 1)])
        say(1)
        hands.until("kill 1")


def test_a_disk_has_room_again_once_the_recorder_says_that_it_is_full(arms: Any, tmp_path: Path):
    bus, say = arms
    recorder = say.bus("recorder/1").publisher(RECORDER_STATUS)
    hands = Noted()
    with Injector(bus, hands) as injector:
        injector.begin("t", tmp_path, [fault("disk", 1), fault("clock", 1)])
        say(1)
        hands.until("disk 1", "clock 1")
        for state in ("recording", "error", "error"):
            recorder.put(status(state))
        hands.until("disk 1", "clock 1", "undo disk")
        disk, clock = injector.end()
        assert 0 < disk.until_ns < clock.until_ns


def test_a_mistake_is_told(arms: Any, tmp_path: Path):
    bus, say = arms
    hands = Noted(mistake=True)
    with ExitStack() as inside:
        injector = inside.enter_context(Injector(bus, hands))
        injector.begin("t", tmp_path, [fault("kill", 1)])
        say(1)
        hands.until("kill 1")
        with pytest.raises(InjectorFailed):
            inside.close()
