"""The way to arms of another process: what is sent, and which measurement counts."""

import threading
from collections.abc import Iterator
from typing import Any

import pytest

from fras_common.bus import MemoryBus, MemoryFabric
from fras_common.messages import JawState, JointState, ServoJaw, ServoJoints
from fras_common.service import ServiceHost
from fras_common.topics import CRTK, Topic
from fras_motion.crtk.link import CrtkLink
from fras_motion.drivers import Measured
from support.arms import HOME, off

PSM1, PSM2 = CRTK
STILL = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
START = HOME["psm1"]
SILENCE_S = 0.05
ANSWER_S = 10.0


class Arms:
    """Two arms that a test plays, and the link to them."""

    def __init__(self, answer_timeout_s: float) -> None:
        fabric = MemoryFabric()
        self.bus = MemoryBus(fabric, "cell", "arms/test")
        self.host = ServiceHost("motion")
        self.host.attach(MemoryBus(fabric, "cell", "motion/test"))
        self.link = CrtkLink(self.host, answer_timeout_s)
        self.told: list[tuple[str, Any]] = []
        for keys in CRTK:
            self._listen_to(keys.servo_jp)
            self._listen_to(keys.jaw_servo_jp)
        self._joints = {keys.arm: self.bus.publisher(keys.measured_js) for keys in CRTK}
        self._jaws = {keys.arm: self.bus.publisher(keys.jaw_measured_js) for keys in CRTK}

    def _listen_to(self, topic: Topic[Any]) -> None:
        self.bus.subscribe(topic, lambda message: self.told.append((topic.key, message)))

    def say_jaw(self, arm: str, jaw_rad: float) -> None:
        self._jaws[arm].put(JawState(jaw_rad=jaw_rad))

    def say_joints(self, arm: str, joints: Any) -> None:
        self._joints[arm].put(JointState(joints=joints, joint_velocities=STILL))

    def close(self) -> None:
        self.host.bus.close()
        self.bus.close()


@pytest.fixture
def arms() -> Iterator[Arms]:
    made = Arms(SILENCE_S)
    yield made
    made.close()


def test_a_setpoint_goes_out_as_jaw_and_joints_of_that_arm_only(arms: Arms) -> None:
    arms.link.send("psm2", START)
    assert [key for key, _ in arms.told] == [PSM2.jaw_servo_jp.key, PSM2.servo_jp.key]
    jaw, joints = (message for _, message in arms.told)
    assert isinstance(jaw, ServoJaw)
    assert isinstance(joints, ServoJoints)
    assert (joints.joints, jaw.jaw_rad) == (START.joints, START.jaw_rad)


def test_the_first_measurement_after_the_setpoint_is_taken_and_none_before(arms: Arms) -> None:
    arms.say_jaw("psm1", 1.0)
    arms.say_joints("psm1", off(START.joints, 0, -0.1))
    arms.link.send("psm1", START)
    assert arms.link.measured("psm1") is None
    arms.say_jaw("psm1", 0.9)
    arms.say_joints("psm1", START.joints)
    arms.say_joints("psm1", off(START.joints, 0, 0.1))
    assert arms.link.measured("psm1") == Measured(START.joints, STILL, 0.9)


def test_joints_without_a_jaw_are_no_measurement(arms: Arms) -> None:
    arms.say_joints("psm1", START.joints)
    assert arms.link.measured("psm1") is None


def test_each_arm_speaks_for_itself(arms: Arms) -> None:
    arms.say_jaw("psm2", 1.0)
    arms.say_joints("psm2", START.joints)
    assert arms.link.measured("psm1") is None
    assert arms.link.measured("psm2") is not None


def test_who_waits_is_woken_by_what_comes() -> None:
    arms = Arms(ANSWER_S)
    try:
        arms.say_jaw("psm1", 1.0)
        arms.link.listen("psm1")
        got: list[Measured | None] = []
        waiting = threading.Thread(target=lambda: got.append(arms.link.measured("psm1")))
        waiting.start()
        arms.say_joints("psm1", START.joints)
        waiting.join(ANSWER_S)
        assert got == [Measured(START.joints, STILL, 1.0)]
    finally:
        arms.close()


def test_motion_is_not_ready_before_the_arms_are(arms: Arms) -> None:
    def settled() -> str:
        while arms.host.drain(0.0):
            pass
        return arms.host.state

    arms.host.announce_alive()
    assert settled() == "starting"
    arms.bus.announce("alive/arms")
    assert settled() == "ready"
