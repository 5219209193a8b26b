"""Motion whose arms are those of another process, which the test plays; in-memory bus."""

from collections.abc import Callable, Iterator
from typing import Any, cast

import pytest

from fras_common.bus import MemoryBus, RemoteFault
from fras_common.messages import (
    ActionResult,
    CancelRequest,
    ExecuteReply,
    HoldRequest,
    HoldState,
    JawState,
    JointState,
    LastReply,
    OperatingState,
    ResetRequest,
    ResumeRequest,
    RobotState,
    ServoJaw,
    ServoJoints,
    StateCommand,
)
from fras_common.messages.crtk import State
from fras_common.messages.robot import Joints
from fras_common.scenario import RunSection, Scenario, resolve
from fras_common.topics import (
    ACTION_RESULT,
    CANCEL,
    CRTK,
    EXECUTE,
    HOLD,
    MOTION_RESET,
    RECORDER_LAST,
    RESUME,
    ROBOT_STATE,
    VERDICT,
    ArmTopics,
)
from fras_motion.crtk.link import CrtkLink
from fras_motion.service import MotionService
from support.arms import HOME, off
from support.goals import reach_goal
from support.shells import ShellBench
from support.verdicts import verdict

PSM1, PSM2 = CRTK
STILL = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
TURNS = 5000


class Arms:
    """Two ideal arms that answer each setpoint at once."""

    def __init__(self, bus: MemoryBus) -> None:
        self.bus = bus
        self.jaws = {name: setpoint.jaw_rad for name, setpoint in HOME.items()}
        self.joints: dict[str, Joints] = {name: setpoint.joints for name, setpoint in HOME.items()}
        self.told = 0
        self.commands: list[tuple[str, str]] = []
        self._measured_jaw = {keys.arm: bus.publisher(keys.jaw_measured_js) for keys in CRTK}
        self._measured = {keys.arm: bus.publisher(keys.measured_js) for keys in CRTK}
        self._states = {keys.arm: bus.publisher(keys.operating_state) for keys in CRTK}
        for keys in CRTK:
            bus.subscribe(keys.jaw_servo_jp, self._on_jaw(keys.arm))
            bus.subscribe(keys.servo_jp, self._on_joints(keys.arm))
            bus.subscribe(keys.state_command, self._on_command(keys.arm))

    def say_state(self, arm: str, state: State, *, is_homed: bool = True) -> None:
        self._states[arm].put(OperatingState(state=state, is_homed=is_homed, is_busy=False))

    def say_where(self) -> None:
        for arm in self.joints:
            self._measured_jaw[arm].put(JawState(jaw_rad=self.jaws[arm]))
            self._measured[arm].put(JointState(joints=self.joints[arm], joint_velocities=STILL))

    def _on_command(self, arm: str) -> Callable[[StateCommand], None]:
        return lambda message: self.commands.append((arm, message.command))

    def _on_jaw(self, arm: str) -> Callable[[ServoJaw], None]:
        def follow(message: ServoJaw) -> None:
            self.jaws[arm] = message.jaw_rad

        return follow

    def _on_joints(self, arm: str) -> Callable[[ServoJoints], None]:
        def follow(message: ServoJoints) -> None:
            self.told += 1
            self.joints[arm] = message.joints

        return follow


class Bench(ShellBench):
    """Motion with the driver crtk; the test plays the arms and SA."""

    def __init__(self) -> None:
        super().__init__("motion", lambda host: MotionService(host, "crtk"), client="sa/test")
        self.states: list[RobotState] = self.heard(ROBOT_STATE)
        self.results: list[ActionResult] = self.heard(ACTION_RESULT)
        self._verdicts = self.client.publisher(VERDICT)
        self.arms = Arms(MemoryBus(self.fabric, "cell", "arms/test"))

    def enable(self) -> None:
        for keys in CRTK:
            self.arms.say_state(keys.arm, "ENABLED")
        self.settle()

    def reset(self, pace: float = 1.0) -> None:
        scenario = resolve(Scenario(run=RunSection(pace=pace)))
        self.answer(MOTION_RESET, ResetRequest(trial="t", scenario=scenario))

    def reach(self) -> ExecuteReply:
        return self.answer(EXECUTE, reach_goal())

    def judge(self) -> None:
        """Judge the present tick, and do what is due of the next."""
        tick = self.states[-1].tick
        self._verdicts.put(verdict(tick, "t"))
        for _ in range(TURNS):
            self.settle()
            if self.states[-1].tick > tick or self.results or self.stands_held:
                return
            self.host.drain(0.005)
        raise AssertionError("no tick came")

    @property
    def stands_held(self) -> bool:
        """Whether the action under way stands, and somebody holds it."""
        last = self.states[-1]
        return bool(last.holds) and last.action is not None and last.action.phase == "held"

    @property
    def holds(self) -> dict[str, str]:
        """Who holds, as motion tells whoever asks."""
        state: HoldState = self.answer(HOLD, HoldRequest(holder="cli", reason="to ask"))
        self.answer(RESUME, ResumeRequest(holder="cli", by="cli"))
        return {holder: why for holder, why in state.holds.items() if holder != "cli"}

    def close(self) -> None:
        self.arms.bus.close()
        super().close()


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    made = Bench()
    listen = CrtkLink.listen

    def listen_and_hear(link: CrtkLink, arm: str) -> None:
        listen(link, arm)
        made.arms.say_where()

    # Motion waits in its loop, and everything here happens in that one thread.
    monkeypatch.setattr(CrtkLink, "listen", listen_and_hear)
    yield made
    made.close()


def test_it_is_ready_when_its_peers_and_the_arms_are_alive(bench: Bench) -> None:
    bench.client.serve(RECORDER_LAST, lambda call: call.reply(LastReply(payload=b"")))
    bench.host.announce_alive()
    for service in ("sim", "sa", "recorder"):
        bench.client.announce(f"alive/{service}")
    bench.settle()
    assert bench.host.state == "starting"
    bench.arms.bus.announce("alive/arms")
    bench.settle()
    assert bench.host.state == "ready"


def test_arms_not_heard_of_are_held(bench: Bench) -> None:
    assert bench.holds == {"arms/psm1": "not heard of", "arms/psm2": "not heard of"}
    bench.arms.say_state("psm1", "ENABLED")
    bench.settle()
    assert bench.holds == {"arms/psm2": "not heard of"}
    bench.arms.say_state("psm2", "ENABLED")
    bench.settle()
    assert bench.holds == {}


@pytest.mark.parametrize("state", ["DISABLED", "PAUSED", "FAULT"])
def test_arms_that_may_not_move_hold_motion_until_they_are_enabled(
    bench: Bench, state: State
) -> None:
    bench.enable()
    bench.reset()
    bench.arms.say_state("psm2", state)
    bench.settle()
    assert bench.states[-1].holds == {"arms/psm2": state.lower()}
    assert bench.states[-1].arms["psm2"].operating_state == state
    assert bench.states[-1].arms["psm1"].operating_state == "PAUSED"
    # One that is not allowed to move either lifts nothing.
    for other in ("DISABLED", "PAUSED", "FAULT"):
        bench.arms.say_state("psm2", other)
    bench.arms.say_state("psm2", "ENABLED", is_homed=False)
    bench.arms.say_state("psm1", "ENABLED")
    bench.settle()
    assert bench.states[-1].holds == {"arms/psm2": "not homed"}
    bench.arms.say_state("psm2", "ENABLED")
    bench.settle()
    assert bench.states[-1].holds == {}
    assert bench.states[-1].arms["psm2"].operating_state == "ENABLED"


def test_the_arms_lift_nobody_elses_hold(bench: Bench) -> None:
    bench.enable()
    bench.reset()
    bench.answer(HOLD, HoldRequest(holder="surgeon", reason="bleeding"))
    bench.arms.say_state("psm1", "PAUSED")
    bench.settle()
    bench.enable()
    assert bench.states[-1].holds == {"surgeon": "bleeding"}


@pytest.mark.parametrize("pace", [0.0, 1.5])
def test_another_pace_than_theirs_is_refused_by_name(bench: Bench, pace: float) -> None:
    bench.enable()
    with pytest.raises(RemoteFault) as refused:
        bench.reset(pace)
    assert refused.value.remote_kind == "PaceTooFast"
    assert f"pace {pace:g}" in str(refused.value)
    assert bench.states == []


def test_arms_away_from_home_begin_no_trial_and_nothing_moves_them(bench: Bench) -> None:
    bench.enable()
    bench.arms.joints["psm2"] = cast(Joints, off(HOME["psm2"].joints, 2, 0.02))
    with pytest.raises(RemoteFault, match="insertion is") as refused:
        bench.reset()
    assert refused.value.remote_kind == "DriverFault"
    assert bench.arms.told == 0


def test_an_action_is_carried_out_by_the_arms(bench: Bench) -> None:
    bench.enable()
    bench.reset()
    assert bench.arms.told == 0  # tick 0 is where they stand
    assert bench.reach().accepted
    while not bench.results:
        bench.judge()
    assert bench.results[-1].outcome == "succeeded"
    last = bench.states[-1]
    assert bench.arms.joints["psm1"] == last.arms["psm1"].setpoint_joints
    assert last.arms["psm1"].joints == last.arms["psm1"].setpoint_joints
    assert bench.arms.joints["psm2"] == HOME["psm2"].joints


def test_arms_that_stop_in_mid_action_are_waited_for(bench: Bench) -> None:
    bench.enable()
    bench.reset()
    bench.reach()
    for _ in range(10):
        bench.judge()
    bench.arms.say_state("psm1", "DISABLED")
    bench.settle()
    began = bench.states[-1].tick
    while not bench.stands_held:
        bench.judge()
    assert bench.states[-1].tick - began <= 3
    told = bench.arms.told
    bench.judge()
    assert bench.arms.told == told
    bench.enable()
    bench.judge()
    assert (bench.results[-1].outcome, bench.results[-1].reason) == ("interrupted", "hold")


def keys_of(topics: tuple[ArmTopics, ...]) -> set[str]:
    return {topic.key for arm in topics for topic in (arm.measured_js, arm.operating_state)}


def test_motion_does_not_speak_for_arms_that_are_not_its_own(bench: Bench) -> None:
    said: list[Any] = []
    bench.client.subscribe_raw("**", said.append)
    bench.enable()
    bench.reset()
    bench.reach()
    bench.judge()
    sources = {sample.key for sample in said if b"motion/test" in sample.payload}
    assert not sources & keys_of(CRTK)
    assert {PSM1.servo_jp.key, PSM2.jaw_servo_jp.key} <= sources


def test_a_stop_between_trials_pauses_the_arms_whoever_leads_them(bench: Bench) -> None:
    bench.enable()
    bench.answer(HOLD, HoldRequest(holder="surgeon", reason="stop"))
    both = [("psm1", "pause"), ("psm2", "pause")]
    assert bench.arms.commands == both
    for keys in CRTK:
        bench.arms.say_state(keys.arm, "PAUSED")
    bench.settle()
    # Who leads an arm may enable it: that lifts no stop.
    bench.arms.say_state("psm1", "ENABLED")
    bench.settle()
    assert bench.arms.commands[2:] == [("psm1", "pause")]
    bench.arms.say_state("psm1", "PAUSED")
    bench.settle()
    bench.answer(RESUME, ResumeRequest(holder="surgeon", by="cli"))
    assert bench.arms.commands[3:] == [("psm1", "resume"), ("psm2", "resume")]
    bench.enable()
    assert len(bench.arms.commands) == 5


def test_an_arm_that_another_paused_is_not_resumed(bench: Bench) -> None:
    bench.enable()
    bench.arms.say_state("psm2", "PAUSED")
    bench.settle()
    bench.answer(HOLD, HoldRequest(holder="surgeon", reason="stop"))
    bench.answer(RESUME, ResumeRequest(holder="surgeon", by="cli"))
    assert bench.arms.commands == [("psm1", "pause"), ("psm1", "resume")]


def test_a_stop_in_a_trial_is_brought_about_by_its_setpoints(bench: Bench) -> None:
    bench.enable()
    bench.reset()
    bench.answer(HOLD, HoldRequest(holder="surgeon", reason="stop"))
    assert bench.arms.commands == []
    bench.answer(CANCEL, CancelRequest(trial="t", reason="over"))
    bench.settle()
    assert bench.arms.commands == [("psm1", "pause"), ("psm2", "pause")]
