"""The driver for arms of another process, a link made by hand; motion with one that fails."""

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from math import nan

import pytest

from fras_motion.controller import MotionController
from fras_motion.drivers import CrtkDriver, DriverFault, Measured, Setpoint, SimulatedDriver
from fras_motion.kinematics import JOINT_NAMES
from fras_motion.parameters import MotionParameters
from fras_motion.states import Advance, Goal
from support.arms import HOME, off

AT_HOME = HOME["psm1"]
STILL = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
REACH = Goal("g1", "reach", "psm1", "b(2,2)", (0.03, 0.03, 0.005))
DT_S = 0.02


class HandMadeLink:
    """Arms that say what they are told to say; None is silence."""

    def __init__(self, *says: Measured | None) -> None:
        self.says = deque(says)
        self.heard: list[tuple[str, Setpoint | None]] = []

    def listen(self, arm: str) -> None:
        self.heard.append((arm, None))

    def send(self, arm: str, setpoint: Setpoint) -> None:
        self.heard.append((arm, setpoint))

    def measured(self, arm: str) -> Measured | None:
        del arm
        return self.says.popleft()


def at(setpoint: Setpoint) -> Measured:
    return Measured(setpoint.joints, STILL, setpoint.jaw_rad)


def fault(call: Callable[[], object]) -> DriverFault:
    with pytest.raises(DriverFault) as caught:
        call()
    assert (caught.value.arm, caught.value.whose) == ("psm1", "arms")
    return caught.value


def test_a_trial_begins_where_the_arm_is_measured_to_stand() -> None:
    near = at(replace(AT_HOME, joints=off(AT_HOME.joints, 0, 0.001)))
    link = HandMadeLink(near)
    assert CrtkDriver("psm1", link).reset(AT_HOME) == near
    # Nothing moved it: it was only listened to.
    assert link.heard == [("psm1", None)]


@pytest.mark.parametrize(
    ("joint", "by"), [(0, 0.0021), (1, -0.0021), (2, 0.0011), (5, 0.0021), (2, nan)]
)
def test_an_arm_that_is_not_at_home_is_refused_with_joint_and_values(joint: int, by: float) -> None:
    elsewhere = replace(AT_HOME, joints=off(AT_HOME.joints, joint, by))
    link = HandMadeLink(at(elsewhere))
    refused = fault(lambda: CrtkDriver("psm1", link).reset(AT_HOME))
    assert refused.values["joint"] == JOINT_NAMES[joint]
    assert refused.values["wanted"] == AT_HOME.joints[joint]
    assert refused.values["value"] == pytest.approx(elsewhere.joints[joint], nan_ok=True)
    assert "move_cp" in str(refused)
    assert [setpoint for _, setpoint in link.heard] == [None]


def test_a_jaw_that_is_not_open_is_refused() -> None:
    link = HandMadeLink(at(replace(AT_HOME, jaw_rad=AT_HOME.jaw_rad - 0.06)))
    assert fault(lambda: CrtkDriver("psm1", link).reset(AT_HOME)).values["joint"] == "jaw"


def test_a_silent_arm_is_a_fault_of_the_arms() -> None:
    assert "run?" in str(fault(lambda: CrtkDriver("psm1", HandMadeLink(None)).reset(AT_HOME)))
    driver = CrtkDriver("psm1", HandMadeLink(at(AT_HOME), None))
    driver.reset(AT_HOME)
    driver.send(AT_HOME)
    fault(lambda: driver.measure(DT_S))


@pytest.mark.parametrize(
    ("change", "joint"),
    [
        (lambda s: replace(s, joints=off(s.joints, 0, 0.16)), "yaw"),
        (lambda s: replace(s, joints=off(s.joints, 2, -0.016)), "insertion"),
        (lambda s: replace(s, jaw_rad=s.jaw_rad - 0.81), "jaw"),
        (lambda s: replace(s, jaw_rad=nan), "jaw"),
    ],
)
def test_an_arm_that_does_not_follow_is_a_fault(
    change: Callable[[Setpoint], Setpoint], joint: str
) -> None:
    driver = CrtkDriver("psm1", HandMadeLink(at(AT_HOME), at(change(AT_HOME))))
    driver.reset(AT_HOME)
    driver.send(AT_HOME)
    refused = fault(lambda: driver.measure(DT_S))
    assert refused.values["joint"] == joint
    assert "fault/arms" in str(refused)


def test_an_arm_may_lag_behind_as_servos_do() -> None:
    lagging = at(replace(AT_HOME, joints=off(AT_HOME.joints, 0, 0.01)))
    driver = CrtkDriver("psm1", HandMadeLink(at(AT_HOME), lagging))
    driver.reset(AT_HOME)
    driver.send(AT_HOME)
    assert driver.measure(DT_S) == lagging


class FailingDriver(SimulatedDriver):
    """Fails at one measurement, and works again after a reset."""

    def __init__(self, fails_at: int) -> None:
        super().__init__(time_constant_s=0.0)
        self.left = fails_at

    def measure(self, dt_s: float) -> Measured:
        self.left -= 1
        if self.left == 0:
            raise DriverFault("psm1 does not answer", arm="psm1", whose="arms")
        return super().measure(dt_s)


def test_a_driver_that_fails_ends_the_action_by_the_name_of_its_service(
    run: Callable[..., list[Advance]],
) -> None:
    parameters = MotionParameters(driver_time_constant_s=0.0)
    failing = FailingDriver(20)
    drivers = {"psm1": failing, "psm2": SimulatedDriver(time_constant_s=0.0)}
    controller = MotionController(parameters, drivers=drivers)
    ticks = run(controller, REACH)
    result = ticks[-1].result
    assert result is not None
    assert (result.outcome, result.reason) == ("aborted", "hold:arms")
    assert result.text == "psm1 does not answer"
    assert result.values["arm"] == "psm1"
    assert (result.tick, len(ticks)) == (20, 20)
    last = controller.snapshot
    assert last.tick == 20
    assert last.action is not None
    assert last.action.phase == "interrupted"
    # What it measured last still stands; nothing is made up.
    assert last.arms["psm1"].joints == ticks[-2].snapshot.arms["psm1"].joints
    assert not controller.wants_tick

    assert controller.reset().tick == 0
    again = run(controller, REACH)[-1].result
    assert again is not None
    assert again.outcome == "succeeded"


def test_arms_that_are_not_at_home_begin_no_trial() -> None:
    elsewhere = replace(AT_HOME, joints=off(AT_HOME.joints, 0, 0.1))
    drivers = {
        "psm1": CrtkDriver("psm1", HandMadeLink(at(elsewhere))),
        "psm2": CrtkDriver("psm2", HandMadeLink(at(HOME["psm2"]))),
    }
    fault(lambda: MotionController(MotionParameters(), drivers=drivers))


def test_an_arm_is_taken_over_where_it_was_last_sent() -> None:
    sent = replace(AT_HOME, joints=off(AT_HOME.joints, 0, 0.3))
    now = at(replace(sent, joints=off(sent.joints, 0, 0.1)))
    link = HandMadeLink(now, at(sent))
    driver = CrtkDriver("psm1", link)
    assert driver.resume(sent, at(AT_HOME), 41) == now
    assert link.heard == [("psm1", None)]
    assert driver.measure(DT_S) == at(sent)


def test_an_arm_that_somebody_led_elsewhere_is_not_taken_over() -> None:
    sent = replace(AT_HOME, joints=off(AT_HOME.joints, 0, 0.3))
    driver = CrtkDriver("psm1", HandMadeLink(at(AT_HOME)))
    assert fault(lambda: driver.resume(sent, at(sent), 41)).values["joint"] == JOINT_NAMES[0]
