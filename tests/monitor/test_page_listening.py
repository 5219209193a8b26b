"""What the page hears, in the order in which it counts."""

from collections.abc import Callable
from types import SimpleNamespace

import pytest

from fras_common.bus import Call, MemoryBus, MemoryFabric
from fras_common.codec import encode
from fras_common.messages import Header, Holds, LastReply, LastRequest
from fras_common.service import ServiceHost
from fras_common.topics import HOLDS, RECORDER_LAST, ROBOT_STATE, TISSUE_STATE, VERDICT
from fras_monitor import listening
from fras_monitor.listening import MOST_GLANCE_S, VERDICTS, Listener
from fras_monitor.view import holds_of
from support import pictures as p

HELD = {"monitor": "stop"}


@pytest.fixture
def fabric() -> MemoryFabric:
    return MemoryFabric()


@pytest.fixture
def motion(fabric: MemoryFabric) -> MemoryBus:
    return MemoryBus(fabric, "cell", "motion/1")


@pytest.fixture
def listener(fabric: MemoryFabric) -> Listener:
    host = ServiceHost("monitor")
    host.attach(MemoryBus(fabric, "cell", "monitor/1"))
    return Listener(host)


def test_a_hold_counts_though_a_state_from_before_it_is_looked_at_later(
    motion: MemoryBus, listener: Listener
):
    robot, holds = motion.publisher(ROBOT_STATE), motion.publisher(HOLDS)
    robot.put(p.robot(tick=1))
    holds.put(Holds(holds=HELD))
    assert holds_of(listener.look()) == HELD
    robot.put(p.robot(tick=2, holds=HELD))
    assert holds_of(listener.look()) == HELD
    robot.put(p.robot(tick=3, holds=HELD))
    holds.put(Holds(holds={}))
    assert holds_of(listener.look()) == {}
    robot.put(p.robot(tick=4))
    assert holds_of(listener.look()) == {}


def test_every_verdict_between_two_looks_is_a_point_and_of_states_the_latest_counts(
    fabric: MemoryFabric, motion: MemoryBus, listener: Listener
):
    robot = motion.publisher(ROBOT_STATE)
    verdict = MemoryBus(fabric, "cell", "sa/1").publisher(VERDICT)
    for tick in range(1, VERDICTS + 1):
        robot.put(p.robot(tick=tick))
        verdict.put(p.verdict(tick=tick))
    picture = listener.look()
    assert picture.robot is not None
    assert picture.robot.message.tick == VERDICTS
    assert picture.trace.samples[0].tick == 1
    assert picture.trace.samples[-1].tick >= VERDICTS - 1
    assert listener.look() is picture


def answering(last: dict[str, Header]) -> Callable[[Call[LastRequest, LastReply]], None]:
    """Answer as the recorder does."""

    def answer(call: Call[LastRequest, LastReply]) -> None:
        message = last.get(call.request.key)
        call.reply(LastReply(payload=encode(message) if message is not None else b""))

    return answer


def test_states_that_came_while_none_were_heard_are_looked_up(
    fabric: MemoryFabric, motion: MemoryBus, listener: Listener
):
    robot = motion.publisher(ROBOT_STATE)
    tissue = MemoryBus(fabric, "cell", "sim/1").publisher(TISSUE_STATE)
    verdict = MemoryBus(fabric, "cell", "sa/1").publisher(VERDICT)
    last: dict[str, Header] = {}
    MemoryBus(fabric, "cell", "recorder/1").serve(RECORDER_LAST, answering(last))

    def tick(number: int) -> None:
        last[ROBOT_STATE.key] = robot.put(p.robot(tick=number))
        last[TISSUE_STATE.key] = tissue.put(p.tissue(tick=number))
        verdict.put(p.verdict(tick=number))

    def shown() -> list[int]:
        picture = listener.look()
        heard = (picture.robot, picture.tissue, picture.verdict)
        return [one.message.tick for one in heard if one is not None]

    tick(1)
    assert shown() == [1, 1, 1]
    listener.hear(sparingly=True)
    tick(2)
    assert shown() == [1, 1, 2]
    assert not listener.has_states(now_s=10.0)
    tick(3)
    assert listener.has_states(now_s=10.01)
    assert shown() == [3, 3, 3]
    listener.hear(sparingly=True)
    tick(4)
    assert shown() == [3, 3, 4]
    assert not listener.has_states(now_s=20.0)
    # Nothing comes any more: what is there is drawn, and the last states are asked for.
    assert not listener.has_states(now_s=20.05)
    assert listener.has_states(now_s=20.0 + MOST_GLANCE_S)
    listener.hear(sparingly=False)
    assert shown() == [4, 4, 4]


def test_states_that_nobody_could_tell_are_asked_for_again(
    fabric: MemoryFabric, motion: MemoryBus, listener: Listener, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(listening, "time", clock := SimpleNamespace(monotonic=lambda: 100.0))
    robot, last = motion.publisher(ROBOT_STATE), dict[str, Header]()
    verdict = MemoryBus(fabric, "cell", "sa/1").publisher(VERDICT)

    def shown() -> int:
        picture = listener.look()
        return picture.robot.message.tick if picture.robot is not None else -1

    robot.put(p.robot(tick=1))
    listener.look()
    listener.hear(sparingly=True)
    last[ROBOT_STATE.key] = robot.put(p.robot(tick=2))
    verdict.put(p.verdict(tick=2))
    assert listener.has_states(0.0) or listener.has_states(MOST_GLANCE_S)
    assert shown() == 1
    listener.hear(sparingly=False)
    assert shown() == 1
    MemoryBus(fabric, "cell", "recorder/1").serve(RECORDER_LAST, answering(last))
    listener.hear(sparingly=False)
    assert shown() == 1
    clock.monotonic = lambda: 101.0
    listener.hear(sparingly=False)
    assert shown() == 2
