"""The stop: asked at once, asked again until it is taken, and told with the times it took."""

import threading
import time
from collections.abc import Iterator

import pytest

from fras_common.bus import Call, MemoryBus, MemoryFabric
from fras_common.errors import FrasError
from fras_common.messages import HoldRequest, HoldState
from fras_common.topics import HOLD, ROBOT_STATE
from fras_monitor.stop import HOLDER, Stopper, StopRecord
from support import pictures as p

PATIENCE_S = 20.0
HELD = {HOLDER: "stop"}


def test_the_record_of_a_stop_tells_both_times():
    record = StopRecord(pressed_s=1.0, state="sent").asked()
    assert "not acknowledged" in record.in_words(1.2)
    record = record.acknowledged(1.03)
    assert record.in_words(2.0) == "Stop acknowledged after 30 ms"
    record = record.seen(p.robot(phase="held", holds=HELD), 1.08)
    assert record.in_words(2.0) == "Stop acknowledged after 30 ms, arms at rest after 80 ms"


def test_an_arm_that_still_moves_or_shows_another_hold_is_not_at_rest():
    record = StopRecord(pressed_s=1.0, state="sent")
    assert record.seen(p.robot(phase="lift", holds=HELD), 1.1).state == "sent"
    assert record.seen(p.robot(phase="held", holds={"cli": "x"}), 1.1).state == "sent"
    assert record.seen(p.robot(holds=HELD), 1.1).state == "at_rest"


def test_what_was_at_rest_before_the_answer_stays_so():
    record = StopRecord(pressed_s=1.0, state="sent").seen(p.robot(holds=HELD), 1.05)
    assert record.acknowledged(1.5) == record
    assert record.failed("late") == record


class Motion:
    """Answers holds as a test says."""

    def __init__(self, fabric: MemoryFabric) -> None:
        self.bus = MemoryBus(fabric, "cell", "motion/1")
        self.asked: list[HoldRequest] = []
        self.refuse = 0

    def serve(self) -> None:
        self.bus.serve(HOLD, self._on_hold)

    def _on_hold(self, call: Call[HoldRequest, HoldState]) -> None:
        self.asked.append(call.request)
        if len(self.asked) <= self.refuse:
            call.fail(FrasError("not now"))
        else:
            call.reply(HoldState(holds={call.request.holder: call.request.reason}, tick=3))


class Pressed:
    """A stopper whose changes a test can wait for."""

    def __init__(self, fabric: MemoryFabric) -> None:
        self.changed = threading.Condition()
        self.bus = MemoryBus(fabric, "cell", "monitor/1")
        self.stopper = Stopper(self.bus, self._on_change)

    def _on_change(self) -> None:
        with self.changed:
            self.changed.notify_all()

    def until(self, state: str) -> StopRecord:
        with self.changed:
            assert self.changed.wait_for(lambda: self.stopper.record.state == state, PATIENCE_S)
        return self.stopper.record

    def until_attempts(self, count: int) -> None:
        with self.changed:
            asked = self.changed.wait_for(lambda: self.stopper.record.attempts >= count, PATIENCE_S)
        assert asked


@pytest.fixture
def fabric() -> MemoryFabric:
    return MemoryFabric()


@pytest.fixture
def pressed(fabric: MemoryFabric) -> Iterator[Pressed]:
    made = Pressed(fabric)
    yield made
    made.stopper.close()
    made.bus.close()


def test_a_press_holds_the_arms_by_the_pages_name(fabric: MemoryFabric, pressed: Pressed):
    motion = Motion(fabric)
    motion.serve()
    pressed.stopper.press()
    assert pressed.until("acknowledged").attempts == 1
    assert [one.holder for one in motion.asked] == [HOLDER]
    robot = motion.bus.publisher(ROBOT_STATE)
    robot.put(p.robot(phase="lift", holds=HELD))
    robot.put(p.robot(phase="held", holds=HELD))
    record = pressed.until("at_rest")
    assert record.at_rest_s is not None
    assert record.acknowledged_s is not None
    assert record.at_rest_s >= record.acknowledged_s


def test_who_hears_sparingly_hears_each_state_from_the_press_on(
    fabric: MemoryFabric, pressed: Pressed
):
    motion = Motion(fabric)
    motion.serve()
    robot = motion.bus.publisher(ROBOT_STATE)
    pressed.stopper.hear(sparingly=True)
    # Not heard: else it would be taken for the end of the next stop.
    robot.put(p.robot(phase="held", holds=HELD))
    pressed.stopper.press()
    pressed.until("acknowledged")
    pressed.stopper.hear(sparingly=True)
    said_s = time.monotonic()
    robot.put(p.robot(phase="held", holds=HELD))
    at_rest_s = pressed.until("at_rest").at_rest_s
    assert at_rest_s is not None
    assert at_rest_s >= said_s


def test_arms_that_stand_are_seen_though_every_answer_is_lost(
    fabric: MemoryFabric, pressed: Pressed
):
    motion = Motion(fabric)
    motion.refuse = 10
    motion.serve()
    motion.bus.publisher(ROBOT_STATE).put(p.robot(phase="held", holds=HELD))
    pressed.stopper.press()
    pressed.until("at_rest")
    assert pressed.stopper.record.attempts < motion.refuse


def test_motion_is_asked_again_until_it_says_yes(fabric: MemoryFabric, pressed: Pressed):
    motion = Motion(fabric)
    motion.refuse = 2
    motion.serve()
    pressed.stopper.press()
    assert pressed.until("acknowledged").attempts == 3


def test_a_stop_without_motion_says_so_and_is_taken_once_motion_is_there(
    fabric: MemoryFabric, pressed: Pressed
):
    pressed.stopper.press()
    pressed.until_attempts(2)
    record = pressed.stopper.record
    assert record.state == "sent"
    assert "not acknowledged; no answer yet: " in record.in_words(record.pressed_s + 1.0)
    Motion(fabric).serve()
    pressed.until("acknowledged")


def test_a_stop_that_was_lifted_elsewhere_is_forgotten_here(fabric: MemoryFabric, pressed: Pressed):
    Motion(fabric).serve()
    pressed.stopper.press()
    acknowledged_s = pressed.until("acknowledged").acknowledged_s
    assert acknowledged_s is not None
    # Said before motion took the stop: it tells nothing of it.
    pressed.stopper.see_holds({}, acknowledged_s - 0.1)
    assert pressed.stopper.record.state == "acknowledged"
    pressed.stopper.see_holds(HELD, acknowledged_s + 0.1)
    assert pressed.stopper.record.state == "acknowledged"
    pressed.stopper.see_holds({}, acknowledged_s + 0.1)
    assert pressed.stopper.record.state == "none"


def test_a_stop_that_is_not_taken_yet_is_never_forgotten(pressed: Pressed):
    pressed.stopper.press()
    pressed.stopper.clear()
    assert pressed.stopper.record.state == "sent"
