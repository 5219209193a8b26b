"""Two arms in a process of their own: followed, said, refused; on an in-memory bus."""

from collections.abc import Callable, Iterator
from math import nan
from typing import Any

import numpy as np
import pytest

from fras_common.bus import MemoryBus
from fras_common.messages import (
    FaultRecord,
    Header,
    JointState,
    OperatingState,
    Pose,
    ServoJaw,
    ServoJoints,
    StateCommand,
    TaskStatus,
    TipCommand,
    TipState,
)
from fras_common.topics import CRTK, FAULT, TASK_STATUS, Qos, Topic
from fras_motion.arms import ArmsService
from fras_motion.crtk import DirectControl
from fras_motion.crtk.face import PERIOD_S, CrtkFace
from fras_motion.parameters import MotionParameters
from fras_motion.robots import simulated_drivers
from support.arms import HOME, KINEMATICS, off, rotation_of, tip_in_world
from support.shells import ShellBench

PSM1, PSM2 = CRTK
TURNS = 2000
DOWN = KINEMATICS["psm1"].tool_down_xyzw


class Leader(ShellBench):
    """The arms, and a client that leads them."""

    def __init__(self) -> None:
        super().__init__("arms", ArmsService, client="leader/test")
        self.faults: list[FaultRecord] = self.heard(FAULT.of(service="arms"))
        self.states: list[OperatingState] = self.heard(PSM1.operating_state)
        self.joints: list[JointState] = self.heard(PSM1.measured_js)
        self.tips: list[TipState] = self.heard(PSM1.measured_cp)

    def planner_says(self, status: TaskStatus) -> None:
        self.peers(TASK_STATUS).put(status)
        self.settle()

    def tell(self, topic: Any, message: Header) -> None:
        self.client.publisher(topic).put(message)
        self.settle()

    def turn_until(self, done: Callable[[], bool]) -> None:
        """Drive the loop until something has been said; its pace is the wall clock's."""
        for _ in range(TURNS):
            if done():
                return
            self.host.drain(self.service.wake() or 0.0)
        raise AssertionError("never came")

    def reasons(self) -> list[tuple[str, str, str]]:
        return [(f.key, f.kind, f.values.get("reason", "")) for f in self.faults]


@pytest.fixture
def leader() -> Iterator[Leader]:
    made = Leader()
    yield made
    made.close()


def test_the_arms_stand_at_home_enabled_and_say_so(leader: Leader) -> None:
    leader.turn_until(lambda: bool(leader.joints))
    assert leader.joints[0].joints == HOME["psm1"].joints
    first = leader.states[0]
    assert (first.state, first.is_homed, first.is_busy) == ("ENABLED", True, False)


def test_what_they_say_is_a_hundred_times_a_second_at_most(leader: Leader) -> None:
    leader.turn_until(lambda: len(leader.joints) >= 51)
    stamps_s = [state.stamp_ns * 1e-9 for state in leader.joints]
    # A stamp is made a little after its time: the first of all by milliseconds.
    assert stamps_s[50] - stamps_s[0] >= 48.0 * PERIOD_S


class Said:
    """A host that only counts what is put."""

    def __init__(self) -> None:
        self.counts: dict[str, int] = {}

    def publisher(self, topic: Topic[Any]) -> Any:
        outer = self

        class Counting:
            def put(self, message: Header) -> Header:
                outer.counts[topic.key] = outer.counts.get(topic.key, 0) + 1
                return message

        return Counting()

    def subscribe(self, topic: Topic[Any], handler: Any) -> None:
        del topic, handler


@pytest.mark.parametrize(
    ("period_s", "jitter_s", "share"), [(0.01, 0.004, 1.0), (0.001, 0.0005, 0.1)]
)
def test_each_tick_at_that_rate_is_said_however_unevenly_it_comes(
    period_s: float, jitter_s: float, share: float
) -> None:
    parameters, said = MotionParameters(), Said()
    direct = DirectControl(parameters, KINEMATICS, simulated_drivers(parameters, KINEMATICS), HOME)
    host: Any = said
    face = CrtkFace(host, direct, KINEMATICS, lambda *_: None, lambda *_: None)
    late_s = np.random.default_rng(1).uniform(0.0, jitter_s, 2000)
    snapshot = direct.snapshot(held=False)
    for number, late in enumerate(late_s):
        face.publish(snapshot, {}, -1, 100.0 + number * period_s + float(late))
    assert said.counts[PSM1.measured_js.key] == pytest.approx(share * 2000, abs=7)


def test_servo_commands_are_followed(leader: Leader) -> None:
    leader.turn_until(lambda: bool(leader.joints))
    wanted = off(HOME["psm1"].joints, 0, 0.01)
    leader.tell(PSM1.servo_jp, ServoJoints(joints=wanted))
    leader.turn_until(lambda: abs(leader.joints[-1].joints[0] - wanted[0]) < 1e-6)
    assert leader.faults == []


def test_what_is_measured_as_a_pose_is_the_pose_of_the_joints(leader: Leader) -> None:
    leader.turn_until(lambda: bool(leader.states))
    half = np.radians(20.0)
    x, y, z, w = DOWN
    c, s = float(np.cos(half)), float(np.sin(half))
    turned = (c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z)
    there = Pose(position_m=(0.03, 0.02, 0.045), quaternion_xyzw=turned)
    leader.tell(PSM1.move_cp, TipCommand(tip_in_world=there))
    leader.turn_until(lambda: leader.states[-1].is_busy)
    leader.turn_until(lambda: not leader.states[-1].is_busy)
    assert leader.faults == []

    tips = {tip.seq: tip.tip_in_world for tip in leader.tips}
    compared = [(state.joints, tips[state.seq]) for state in leader.joints if state.seq in tips]
    assert len(compared) > 20
    for joints, tip in compared:
        pose = tip_in_world("psm1", joints)
        np.testing.assert_allclose(tip.position_m, pose[:3, 3], rtol=0, atol=1e-12)
        np.testing.assert_allclose(rotation_of(tip.quaternion_xyzw), pose[:3, :3], atol=1e-12)
    travelled = np.ptp([tip.position_m for _, tip in compared], axis=0)
    assert np.linalg.norm(travelled) > 0.02


@pytest.mark.parametrize(
    ("topic", "message", "reason"),
    [
        (PSM1.servo_jp, ServoJoints(joints=off(HOME["psm1"].joints, 0, 0.2)), "joint_speed"),
        (PSM1.servo_jp, ServoJoints(joints=off(HOME["psm1"].joints, 2, 0.2)), "joint_limits"),
        (PSM1.jaw_servo_jp, ServoJaw(jaw_rad=-0.3), "jaw_speed"),
        (PSM1.state_command, StateCommand(command="resume"), "wrong_state"),
    ],
)
def test_what_is_refused_is_told_on_their_own_key_and_moves_nothing(
    leader: Leader, topic: Any, message: Header, reason: str
) -> None:
    leader.turn_until(lambda: bool(leader.joints))
    leader.tell(topic, message)
    assert leader.reasons() == [(topic.key, "CommandRefused", reason)]
    before = len(leader.joints)
    leader.turn_until(lambda: len(leader.joints) > before + 2)
    assert leader.joints[-1].joints == HOME["psm1"].joints


@pytest.mark.parametrize("command", ["pause", "disable", "unhome"])
def test_a_stopped_arm_refuses_to_move_by_its_state(leader: Leader, command: Any) -> None:
    leader.tell(PSM1.state_command, StateCommand(command=command))
    leader.tell(PSM1.servo_jp, ServoJoints(joints=HOME["psm1"].joints))
    reason = "not_homed" if command == "unhome" else "wrong_state"
    assert leader.reasons() == [(PSM1.servo_jp.key, "CommandRefused", reason)]
    leader.turn_until(lambda: bool(leader.states))
    # The other one is free.
    leader.tell(PSM2.servo_jp, ServoJoints(joints=HOME["psm2"].joints))
    assert len(leader.faults) == 1


class Joints(Header, frozen=True, kw_only=True):
    """What a stranger sends: our own types don't let it be made."""

    joints: tuple[float, ...]


class Command(Header, frozen=True, kw_only=True):
    """Another one."""

    command: str


@pytest.mark.parametrize(
    ("topic", "message", "problem"),
    [
        (PSM1.servo_jp, Joints(joints=off(HOME["psm1"].joints, 3, nan)), "joints is not finite"),
        (PSM1.servo_jp, Joints(joints=HOME["psm1"].joints[:5]), "$.joints"),
        (PSM1.state_command, Command(command="explode"), "$.command"),
        (PSM1.move_cp, Joints(joints=()), "joints"),
    ],
)
def test_what_is_no_command_is_refused_by_key_and_field(
    leader: Leader, topic: Topic[Any], message: Header, problem: str
) -> None:
    leader.tell(Topic(topic.key, type(message), "client", Qos.COMMAND, "never"), message)
    assert leader.reasons() == [(topic.key, "MalformedMessage", "")]
    assert problem in leader.faults[0].text
    assert leader.host.counts["malformed"] == 1
    leader.turn_until(lambda: len(leader.joints) > 2)
    assert leader.joints[-1].joints == HOME["psm1"].joints


def test_an_arm_that_was_enabled_again_follows(leader: Leader) -> None:
    leader.turn_until(lambda: bool(leader.joints))
    leader.tell(PSM1.state_command, StateCommand(command="disable"))
    leader.turn_until(lambda: leader.states[-1].state == "DISABLED")
    leader.tell(PSM1.state_command, StateCommand(command="enable"))
    leader.turn_until(lambda: leader.states[-1].state == "ENABLED")
    wanted = off(HOME["psm1"].joints, 0, 0.005)
    leader.tell(PSM1.servo_jp, ServoJoints(joints=wanted))
    leader.turn_until(lambda: abs(leader.joints[-1].joints[0] - wanted[0]) < 1e-6)
    assert leader.faults == []


def task(phase: Any) -> TaskStatus:
    return TaskStatus(
        trial="t", phase=phase, action="", goal_id="", tried=[], plans=1, replans=0,
        scenario_kind="A", actions=[], outcome="", reason="", violations=[],
    )  # fmt: skip


def near_home() -> ServoJoints:
    yaw, *rest = HOME["psm1"].joints
    a, b, c, d, e = rest
    return ServoJoints(joints=(yaw + 0.002, a, b, c, d, e))


def test_while_a_trial_runs_only_motion_leads_them(leader: Leader) -> None:
    leader.client.announce("alive/planner")
    leader.planner_says(task("acting"))
    leader.tell(PSM1.servo_jp, near_home())
    assert leader.reasons() == [(PSM1.servo_jp.key, "CommandRefused", "trial_runs")]
    motion = MemoryBus(leader.fabric, "cell", "motion/7")
    motion.publisher(PSM1.servo_jp).put(near_home())
    leader.turn_until(
        lambda: (
            bool(leader.joints) and abs(leader.joints[-1].joints[0] - near_home().joints[0]) < 1e-6
        )
    )
    motion.close()
    leader.planner_says(task("ended"))
    leader.tell(PSM1.servo_jp, ServoJoints(joints=HOME["psm1"].joints))
    assert len(leader.faults) == 1


def test_a_trial_whose_planner_is_gone_keeps_nobody_from_leading_them(leader: Leader) -> None:
    leader.planner_says(task("acting"))
    leader.tell(PSM1.servo_jp, near_home())
    assert leader.faults == []
