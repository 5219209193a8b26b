"""The arms under CRTK's keys, as a client of motion sees them: in-memory bus, no trial and one."""

import time
from collections.abc import Callable, Iterator
from itertools import combinations
from math import inf, nan
from types import SimpleNamespace
from typing import Any

import pytest

from fras_common.bus import RemoteFault
from fras_common.messages import (
    CancelRequest,
    ExecuteReply,
    FaultRecord,
    Header,
    HoldRequest,
    JawState,
    JointState,
    OperatingState,
    Pose,
    ResetRequest,
    ResumeRequest,
    RobotState,
    ServoJaw,
    ServoJoints,
    StateCommand,
    TipCommand,
    TipState,
)
from fras_common.scenario import RunSection, Scenario, resolve
from fras_common.topics import (
    CANCEL,
    CRTK,
    EXECUTE,
    FAULT,
    HOLD,
    MOTION_RESET,
    RESUME,
    ROBOT_STATE,
    VERDICT,
    ArmTopics,
)
from fras_motion import service as motion_service
from fras_motion.kinematics import BASES_IN_WORLD, ArmKinematics
from fras_motion.service import MotionService
from support.arms import HOME
from support.goals import reach_goal
from support.shells import ShellBench
from support.verdicts import verdict

PSM1, PSM2 = CRTK
DOWN = ArmKinematics(BASES_IN_WORLD["psm1"]).tool_down_xyzw
START = HOME["psm1"].joints
TURNS = 400
PERIOD_S = 0.01


class Client(ShellBench):
    """Motion with simulated arms, and a client that leads them."""

    def __init__(self) -> None:
        super().__init__("motion", MotionService, client="leader/test")
        self.faults: list[FaultRecord] = self.heard(FAULT.of(service="motion"))
        self.states: dict[str, list[OperatingState]] = {
            keys.arm: self.heard(keys.operating_state) for keys in CRTK
        }
        self.joints: dict[str, list[JointState]] = {
            keys.arm: self.heard(keys.measured_js) for keys in CRTK
        }
        self.tips: dict[str, list[TipState]] = {
            keys.arm: self.heard(keys.measured_cp) for keys in CRTK
        }
        self.jaws: dict[str, list[JawState]] = {
            keys.arm: self.heard(keys.jaw_measured_js) for keys in CRTK
        }
        self._publishers: dict[str, Any] = {}
        self.settle()

    def tell(self, topic: Any, message: Header) -> None:
        if topic.key not in self._publishers:
            self._publishers[topic.key] = self.client.publisher(topic)
        self._publishers[topic.key].put(message)
        self.settle()

    def state_command(self, keys: ArmTopics, command: Any) -> None:
        self.tell(keys.state_command, StateCommand(command=command))

    def turn_until(self, done: Callable[[], bool]) -> None:
        """Drive the loop until something has been said; its pace is the wall clock's."""
        for _ in range(TURNS):
            if done():
                return
            wait_s = self.service.wake()
            self.host.drain(wait_s if wait_s is not None else 0.1)
        raise AssertionError("never came")

    def judge(self, tick: int) -> None:
        """Say as SA does that the arms may move on."""
        self.peers(VERDICT).put(verdict(tick, "t"))
        self.settle()

    def begin_trial(self, trial: str = "t", pace: float = 0.0) -> None:
        scenario = resolve(Scenario(run=RunSection(pace=pace)))
        self.answer(MOTION_RESET, ResetRequest(trial=trial, scenario=scenario))

    def end_trial(self, trial: str = "t") -> None:
        (reply,) = self.ask(CANCEL, CancelRequest(trial=trial, reason="over"))
        assert reply.tick >= 0

    def last_state(self, keys: ArmTopics) -> tuple[str, bool, bool]:
        self.settle()
        said = self.states[keys.arm][-1]
        return said.state, said.is_homed, said.is_busy


@pytest.fixture
def client() -> Iterator[Client]:
    made = Client()
    yield made
    made.close()


def test_the_arms_say_where_they_are_without_being_asked(client: Client) -> None:
    client.turn_until(lambda: len(client.joints["psm2"]) >= 2)
    assert client.last_state(PSM1) == ("ENABLED", True, False)
    kinematics = ArmKinematics(BASES_IN_WORLD["psm1"])
    tip = kinematics.forward(client.joints["psm1"][-1].joints)
    said = client.tips["psm1"][-1].tip_in_world
    assert (said.position_m, said.quaternion_xyzw) == (tip.position_m, tip.quaternion_xyzw)
    assert client.jaws["psm1"][-1].jaw_rad == pytest.approx(1.0471975512)


def test_servo_jp_moves_the_arm_and_only_it(client: Client) -> None:
    client.turn_until(lambda: bool(client.joints["psm1"]))
    start = client.joints["psm1"][-1].joints
    other = client.joints["psm2"][-1].joints
    wanted = (start[0] + 0.005, *start[1:])
    client.tell(PSM1.servo_jp, ServoJoints(joints=wanted))
    client.turn_until(lambda: abs(client.joints["psm1"][-1].joints[0] - wanted[0]) < 1e-5)
    assert client.joints["psm2"][-1].joints == other
    assert client.faults == []


def test_servo_cp_and_the_jaw_are_followed(client: Client) -> None:
    client.turn_until(lambda: bool(client.tips["psm1"]))
    tip, jaw_rad = client.tips["psm1"][-1].tip_in_world, client.jaws["psm1"][-1].jaw_rad
    x, y, z = tip.position_m
    there = Pose(position_m=(x + 0.0005, y, z), quaternion_xyzw=tip.quaternion_xyzw)
    client.tell(PSM1.servo_cp, TipCommand(tip_in_world=there))
    client.turn_until(
        lambda: abs(client.tips["psm1"][-1].tip_in_world.position_m[0] - x - 0.0005) < 1e-6
    )
    client.tell(PSM1.jaw_servo_jp, ServoJaw(jaw_rad=jaw_rad - 0.03))
    client.turn_until(lambda: abs(client.jaws["psm1"][-1].jaw_rad - jaw_rad + 0.03) < 1e-5)
    assert client.faults == []


def test_move_cp_is_busy_until_it_is_there(client: Client) -> None:
    there = Pose(position_m=(0.04, 0.03, 0.055), quaternion_xyzw=DOWN)
    client.tell(PSM1.move_cp, TipCommand(tip_in_world=there))
    client.turn_until(lambda: client.last_state(PSM1)[2])
    client.turn_until(lambda: not client.last_state(PSM1)[2])
    client.turn_until(
        lambda: all(
            abs(a - b) < 1e-5
            for a, b in zip(
                client.tips["psm1"][-1].tip_in_world.position_m, there.position_m, strict=True
            )
        )
    )
    assert client.faults == []


def test_hold_lifted_before_the_next_tick_stops_a_move(client: Client) -> None:
    there = Pose(position_m=(0.04, 0.03, 0.055), quaternion_xyzw=DOWN)
    client.tell(PSM1.move_cp, TipCommand(tip_in_world=there))
    client.turn_until(lambda: client.last_state(PSM1)[2])
    client.client.ask(HOLD, HoldRequest(holder="surgeon", reason="x"), lambda _: None, 5.0)
    client.client.ask(RESUME, ResumeRequest(holder="surgeon", by="cli"), lambda _: None, 5.0)
    client.turn_until(lambda: not client.last_state(PSM1)[2])
    x, y, z = client.tips["psm1"][-1].tip_in_world.position_m
    assert max(abs(x - 0.04), abs(y - 0.03), abs(z - 0.055)) > 1e-3


def reasons(client: Client) -> list[tuple[str, str, str]]:
    return [(f.key, f.kind, f.values.get("reason", "")) for f in client.faults]


@pytest.mark.parametrize(
    ("topic", "message", "reason"),
    [
        (PSM1.servo_jp, ServoJoints(joints=(0.9, 0.0, 0.12, 0.0, 0.0, 0.0)), "joint_speed"),
        (PSM1.jaw_servo_jp, ServoJaw(jaw_rad=3.0), "jaw_limits"),
        (
            PSM1.move_cp,
            TipCommand(tip_in_world=Pose(position_m=(0, 0, 0.9), quaternion_xyzw=DOWN)),
            "unreachable",
        ),
        (
            PSM1.servo_cp,
            TipCommand(
                tip_in_world=Pose(
                    position_m=(0.05, 0.03, 0.06), quaternion_xyzw=(0.0, 0.0, 0.0, 0.0)
                )
            ),
            "not_unit",
        ),
    ],
)
def test_what_is_refused_is_told_on_the_bus_with_its_numbers(
    client: Client, topic: Any, message: Header, reason: str
) -> None:
    client.turn_until(lambda: bool(client.joints["psm1"]))
    before = client.joints["psm1"][-1].joints
    client.tell(topic, message)
    client.turn_until(lambda: len(client.joints["psm1"]) >= 2)
    assert reasons(client) == [(topic.key, "CommandRefused", reason)]
    assert len(client.faults[0].values) > 3
    assert client.host.counts["refused"] == 1
    assert client.joints["psm1"][-1].joints == before


@pytest.mark.parametrize("value", [nan, inf, -inf])
def test_no_number_is_refused_before_it_travels(value: float) -> None:
    with pytest.raises(ValueError, match="not finite"):
        ServoJoints(joints=(value, 0.0, 0.1, 0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="not finite"):
        ServoJaw(jaw_rad=value)
    with pytest.raises(ValueError, match="not finite"):
        TipCommand(tip_in_world=Pose(position_m=(0, value, 0), quaternion_xyzw=DOWN))


def test_while_a_trial_runs_nobody_else_leads_the_arms(client: Client) -> None:
    client.begin_trial()
    states: list[RobotState] = client.heard(ROBOT_STATE)
    start = client.joints["psm1"][-1].joints
    near = (start[0] + 0.001, *start[1:])
    client.tell(PSM1.servo_jp, ServoJoints(joints=near))
    client.state_command(PSM1, "unhome")
    assert [reason for _, _, reason in reasons(client)] == ["trial_runs", "trial_runs"]
    assert states == []
    client.end_trial()
    client.settle()
    client.tell(PSM1.servo_jp, ServoJoints(joints=near))
    client.turn_until(lambda: abs(client.joints["psm1"][-1].joints[0] - near[0]) < 1e-6)
    assert len(client.faults) == 2


def test_the_next_trial_begins_at_home_wherever_a_client_left_the_arms(client: Client) -> None:
    client.turn_until(lambda: bool(client.joints["psm1"]))
    home = client.joints["psm1"][-1].joints
    client.tell(PSM1.servo_jp, ServoJoints(joints=(home[0] + 0.005, *home[1:])))
    client.turn_until(lambda: abs(client.joints["psm1"][-1].joints[0] - home[0]) > 4e-3)
    states: list[RobotState] = client.heard(ROBOT_STATE)
    client.begin_trial()
    assert states[0].arms["psm1"].joints == home


def reach(client: Client) -> ExecuteReply:
    return client.answer(EXECUTE, reach_goal())


def test_in_a_trial_the_acting_arm_is_busy(client: Client) -> None:
    client.begin_trial()
    assert client.last_state(PSM1) == ("ENABLED", True, False)
    assert reach(client).accepted
    assert client.last_state(PSM1) == ("ENABLED", True, True)
    assert client.last_state(PSM2) == ("ENABLED", True, False)


@pytest.mark.parametrize("command", ["pause", "disable"])
def test_a_state_command_that_stops_is_a_hold_also_in_a_trial(client: Client, command: str) -> None:
    client.begin_trial()
    states: list[RobotState] = client.heard(ROBOT_STATE)
    client.state_command(PSM2, command)
    assert states[-1].holds == {"crtk/psm2": command}
    stopped = "PAUSED" if command == "pause" else "DISABLED"
    assert client.last_state(PSM2)[0] == stopped
    assert client.last_state(PSM1)[0] == "PAUSED"
    client.state_command(PSM2, "resume" if command == "pause" else "enable")
    assert states[-1].holds == {}
    assert client.last_state(PSM2)[0] == "ENABLED"
    assert client.faults == []


def test_a_state_command_does_not_lift_what_a_person_holds(client: Client) -> None:
    client.answer(HOLD, HoldRequest(holder="surgeon", reason="bleeding"))
    assert client.last_state(PSM1)[0] == "PAUSED"
    client.state_command(PSM1, "pause")
    client.state_command(PSM1, "resume")
    assert client.last_state(PSM1)[0] == "PAUSED"
    client.turn_until(lambda: bool(client.joints["psm1"]))
    client.tell(PSM1.servo_jp, ServoJoints(joints=client.joints["psm1"][-1].joints))
    assert reasons(client) == [(PSM1.servo_jp.key, "CommandRefused", "held")]
    with pytest.raises(RemoteFault):
        client.answer(RESUME, ResumeRequest(holder="surgeon", by="crtk/psm1"))
    client.answer(RESUME, ResumeRequest(holder="surgeon", by="surgeon"))
    assert client.last_state(PSM1)[0] == "ENABLED"


@pytest.mark.parametrize("command", ["pause", "disable", "unhome"])
def test_an_arm_whose_hold_a_person_lifts_may_move_again_and_says_so(
    client: Client, command: str
) -> None:
    client.begin_trial()
    states: list[RobotState] = client.heard(ROBOT_STATE)
    client.end_trial()
    client.state_command(PSM1, command)
    client.begin_trial("t2")
    assert states[-1].holds == {"crtk/psm1": command}
    client.answer(RESUME, ResumeRequest(holder="crtk/psm1", by="cli"))
    assert client.last_state(PSM1) == ("ENABLED", True, False)
    assert states[-1].holds == {}
    assert client.faults == []


def test_an_arm_that_is_not_homed_holds_until_it_is(client: Client) -> None:
    client.state_command(PSM1, "unhome")
    client.state_command(PSM1, "disable")
    client.state_command(PSM1, "enable")
    assert client.last_state(PSM2)[0] == "PAUSED"
    client.tell(PSM1.servo_jp, ServoJoints(joints=START))
    client.state_command(PSM1, "home")
    assert client.last_state(PSM1) == client.last_state(PSM2) == ("ENABLED", True, False)
    assert [reason for _, _, reason in reasons(client)] == ["not_homed"]


@pytest.mark.parametrize(("keys", "reason"), [(PSM1, "wrong_state"), (PSM2, "held")])
def test_a_paused_arm_refuses_for_its_state_and_the_other_because_it_is_held(
    client: Client, keys: ArmTopics, reason: str
) -> None:
    client.state_command(PSM1, "pause")
    client.tell(keys.jaw_servo_jp, ServoJaw(jaw_rad=1.0))
    assert reasons(client) == [(keys.jaw_servo_jp.key, "CommandRefused", reason)]


def test_a_command_of_the_wrong_state_is_refused_with_the_right_ones(client: Client) -> None:
    client.state_command(PSM1, "resume")
    assert reasons(client) == [(PSM1.state_command.key, "CommandRefused", "wrong_state")]
    assert "PAUSED" in client.faults[0].text


def test_the_arms_of_a_trial_faster_than_life_say_where_they_are_ten_times_a_second(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s, heard = time.monotonic(), client.joints["psm1"]
    monkeypatch.setattr(motion_service, "time", SimpleNamespace(monotonic=lambda: now_s))
    client.begin_trial(pace=0.0)
    reach(client)
    for tick in range(20):
        now_s += 0.02
        client.judge(tick)
    said = [one.tick for one in heard if one.tick > 0]
    assert len(said) == pytest.approx(4, abs=1)
    # What was not said at a tick is not lost: as the arms stand, it is said.
    now_s += 0.1
    client.settle()
    assert heard[-1].tick == 20


def test_the_arms_of_a_trial_at_the_pace_of_life_say_more_often_where_they_are(
    client: Client,
) -> None:
    states: list[RobotState] = client.heard(ROBOT_STATE)
    client.begin_trial(pace=1.0)
    reach(client)
    for tick in range(10):
        client.judge(tick)
        client.turn_until(lambda tick=tick: states[-1].tick > tick)
    client.turn_until(lambda: client.joints["psm1"][-1].tick == 10)
    # At each tick, but for one that comes too soon after a late one; at 10 Hz it would be two.
    assert len({one.tick for one in client.joints["psm1"] if one.tick > 0}) >= 5


def test_the_arms_say_no_more_than_a_hundred_times_a_second(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s, said_at_s, heard = time.monotonic(), [], client.joints["psm1"]
    monkeypatch.setattr(motion_service, "time", SimpleNamespace(monotonic=lambda: now_s))

    def turn_until_said(count: int, late_s: float) -> None:
        nonlocal now_s
        for _ in range(TURNS):
            known = len(heard)
            wait_s = client.service.wake()
            said_at_s.extend([now_s] * (len(heard) - known))
            if len(said_at_s) >= count:
                return
            now_s += late_s + (wait_s if wait_s is not None else 0.1)
        raise AssertionError("never came")

    there = Pose(position_m=(0.04, 0.03, 0.055), quaternion_xyzw=DOWN)
    client.tell(PSM1.move_cp, TipCommand(tip_in_world=there))
    turn_until_said(10, late_s=0.0)
    turn_until_said(20, late_s=0.024)
    client.begin_trial()
    turn_until_said(30, late_s=0.0)
    # What comes late puts the following ones off but for the next.
    for first, later in combinations(range(len(said_at_s)), 2):
        assert said_at_s[later] - said_at_s[first] >= (later - first - 1) * PERIOD_S - 1e-9
