"""What the page hears, in the order in which it counts."""

import pytest

from fras_common.bus import MemoryBus, MemoryFabric
from fras_common.messages import Holds
from fras_common.service import ServiceHost
from fras_common.topics import HOLDS, ROBOT_STATE, VERDICT
from fras_monitor.listening import VERDICTS, Listener
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
