"""Arms led from outside: servo, move, the state machine, the gates; ideal arms, no bus."""

from dataclasses import replace
from itertools import pairwise
from math import acos, dist, inf, nan, pi

import numpy as np
import pytest

from fras_motion.crtk import CommandRefused, DirectControl
from fras_motion.crtk.direct import DIRECT_GATES
from fras_motion.crtk.line import path_length, slerp
from fras_motion.drivers import Setpoint
from fras_motion.kinematics import (
    BASES_IN_WORLD,
    HOME_TIPS_M,
    JOINTS,
    ArmKinematics,
    Joints,
    Pose,
    Quaternion,
)
from fras_motion.parameters import MotionParameters
from fras_motion.robots import home_setpoints, simulated_drivers
from fras_motion.safety import Bounds, GateRefused, Step

PARAMETERS = MotionParameters(driver_time_constant_s=0.0)
DT_S = PARAMETERS.dt_s
KINEMATICS = {name: ArmKinematics(base) for name, base in BASES_IN_WORLD.items()}
HOME = home_setpoints(KINEMATICS, HOME_TIPS_M, PARAMETERS)
DOWN = KINEMATICS["psm1"].tool_down_xyzw
THERE = (0.03, 0.02, 0.045)


@pytest.fixture
def arms() -> DirectControl:
    return DirectControl(PARAMETERS, KINEMATICS, simulated_drivers(PARAMETERS, KINEMATICS), HOME)


def tip(arms: DirectControl, name: str = "psm1") -> Pose:
    return arms.snapshot(held=False)[name].tip_in_world


def joints(arms: DirectControl, name: str = "psm1") -> tuple[float, ...]:
    return arms.snapshot(held=False)[name].setpoint_joints


def turn(degrees: float) -> Quaternion:
    """The tool, turned about the vertical from pointing down."""
    half = np.radians(degrees) / 2
    x, y, z, w = DOWN
    c, s = float(np.cos(half)), float(np.sin(half))
    return (c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z)


def refusal(call: object, *arguments: object) -> CommandRefused:
    assert callable(call)
    with pytest.raises(CommandRefused) as refused:
        call(*arguments)
    return refused.value


def test_servo_jp_is_there_with_the_next_tick(arms: DirectControl) -> None:
    wanted = (HOME["psm1"].joints[0] + 0.005, *HOME["psm1"].joints[1:])
    arms.servo_jp("psm1", wanted)
    assert joints(arms) == HOME["psm1"].joints
    assert arms.moving
    assert arms.tick(held=False) == []
    assert arms.snapshot(held=False)["psm1"].joints == wanted
    assert joints(arms, "psm2") == HOME["psm2"].joints
    assert not arms.moving


def test_a_stream_of_servo_cp_is_followed_at_its_own_rate(arms: DirectControl) -> None:
    x, y, z = HOME_TIPS_M["psm1"]
    for number in range(1, 20):
        there = (x - 0.0009 * number, y, z)
        arms.servo_cp("psm1", Pose(there, DOWN))
        arms.tick(held=False)
        assert dist(tip(arms).position_m, there) < 1e-9


def test_the_last_servo_of_a_tick_counts_and_is_measured_from_where_the_arm_is(
    arms: DirectControl,
) -> None:
    x, y, z = HOME_TIPS_M["psm1"]
    for step in (0.0009, -0.0009, 0.0005):
        arms.servo_cp("psm1", Pose((x + step, y, z), DOWN))
    arms.tick(held=False)
    assert tip(arms).position_m[0] == pytest.approx(x + 0.0005, abs=1e-9)


def turned(step: int) -> Joints:
    """The pitch after some ticks at nearly its full speed."""
    a, b, c, d, e, f = HOME["psm1"].joints
    return (a, b + 0.99 * JOINTS[1].speed * DT_S * step, c, d, e, f)


def test_two_setpoints_of_a_tick_bring_the_way_of_both_where_one_may_be_late() -> None:
    quick = replace(PARAMETERS, free_speed_m_s=0.2, stop_deceleration_m_s2=10.0)
    drivers = simulated_drivers(quick, KINEMATICS)
    for late_s in (0.0, DT_S):
        arms = DirectControl(quick, KINEMATICS, drivers, HOME, late_s=late_s)
        arms.servo_jp("psm1", turned(1))
        arms.tick(held=False)
        arms.servo_jp("psm1", turned(2))
        if late_s:
            arms.servo_jp("psm1", turned(3))
            assert refusal(arms.servo_jp, "psm1", turned(4)).reason == "joint_speed"
        else:
            assert refusal(arms.servo_jp, "psm1", turned(3)).reason == "joint_speed"
        arms.tick(held=False)
        # No joint is faster for it: what a tick could not bring, the next one does.
        assert joints(arms)[1] - turned(1)[1] <= JOINTS[1].speed * DT_S * (1 + 1e-9)
        arms.tick(held=False)
        assert joints(arms) == turned(3 if late_s else 2)
        assert not arms.moving


def test_arms_that_allow_for_lateness_follow_no_faster_than_their_limits() -> None:
    arms = DirectControl(
        PARAMETERS, KINEMATICS, simulated_drivers(PARAMETERS, KINEMATICS), HOME, late_s=DT_S
    )
    x, y, z = HOME_TIPS_M["psm1"]
    goal = Pose((x - 0.9 * PARAMETERS.free_speed_m_s * 0.05, y, z), DOWN)
    arms.servo_cp("psm1", goal)
    arms.servo_jaw("psm1", HOME["psm1"].jaw_rad - 0.03)
    tips, ticks = [tip(arms).position_m], 0
    while arms.moving:
        arms.tick(held=False)
        tips.append(tip(arms).position_m)
        ticks += 1
    assert ticks == 3  # 45 ms of way in ticks of 20 ms
    assert all(dist(a, b) <= PARAMETERS.free_speed_m_s * DT_S * 1.001 for a, b in pairwise(tips))
    assert dist(tips[-1], goal.position_m) < 1e-9
    assert arms.snapshot(held=False)["psm1"].jaw_rad == HOME["psm1"].jaw_rad - 0.03
    # A hold on the way drops the rest of it.
    arms.servo_cp("psm1", Pose((x, y, z), DOWN))
    arms.tick(held=False)
    stands = joints(arms)
    arms.tick(held=True)
    arms.tick(held=False)
    assert joints(arms) == stands


def test_jaw_and_joints_of_one_tick_are_both_followed(arms: DirectControl) -> None:
    wanted = (HOME["psm1"].joints[0] + 0.005, *HOME["psm1"].joints[1:])
    arms.servo_jaw("psm1", HOME["psm1"].jaw_rad - 0.03)
    arms.servo_jp("psm1", wanted)
    arms.tick(held=False)
    state = arms.snapshot(held=False)["psm1"]
    assert state.joints == wanted
    assert state.jaw_rad == HOME["psm1"].jaw_rad - 0.03


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ((0.2, 0, 0, 0, 0, 0), "joint_speed"),
        ((0, 0, 0.006, 0, 0, 0), "cartesian_speed"),
        ((0, 0, nan, 0, 0, 0), "finite"),
        ((0, 0, 0, 0, inf, 0), "finite"),
        ((0, 2.0, 0, 0, 0, 0), "joint_limits"),
    ],
)
def test_a_jump_or_nonsense_is_refused_by_name(
    arms: DirectControl, change: tuple[float, ...], reason: str
) -> None:
    a, b, c, d, e, f = (
        value + more for value, more in zip(HOME["psm1"].joints, change, strict=True)
    )
    assert refusal(arms.servo_jp, "psm1", (a, b, c, d, e, f)).reason == reason
    arms.tick(held=False)
    assert joints(arms) == HOME["psm1"].joints


def test_a_refused_servo_leaves_the_one_before_standing(arms: DirectControl) -> None:
    x, y, z = HOME_TIPS_M["psm1"]
    arms.servo_cp("psm1", Pose((x + 0.0005, y, z), DOWN))
    assert refusal(arms.servo_cp, "psm1", Pose((x + 0.02, y, z), DOWN)).reason in (
        "cartesian_speed",
        "joint_speed",
    )
    arms.tick(held=False)
    assert tip(arms).position_m[0] == pytest.approx(x + 0.0005, abs=1e-9)


def test_an_arm_that_stood_still_may_not_leap(arms: DirectControl) -> None:
    for _ in range(100):
        arms.tick(held=False)
    x, y, z = HOME_TIPS_M["psm1"]
    longest = PARAMETERS.free_speed_m_s * 0.05
    assert refusal(arms.servo_cp, "psm1", Pose((x + 1.05 * longest, y, z), DOWN)).reason == (
        "cartesian_speed"
    )
    arms.servo_cp("psm1", Pose((x + 0.95 * longest, y, z), DOWN))


@pytest.mark.parametrize("jaw_rad", [1.5, -0.8])
def test_a_jaw_beyond_its_range_is_refused(arms: DirectControl, jaw_rad: float) -> None:
    assert refusal(arms.servo_jaw, "psm1", jaw_rad).reason == "jaw_limits"
    assert refusal(arms.servo_jaw, "psm1", 0.0).reason == "jaw_speed"
    assert refusal(arms.servo_jaw, "psm1", nan).reason == "finite"


def run_move(arms: DirectControl, end: Pose, name: str = "psm1") -> list[Pose]:
    arms.move_cp(name, end)
    assert arms.busy(name)
    poses = [tip(arms, name)]
    while arms.busy(name):
        assert len(poses) < 2000
        assert arms.tick(held=False) == []
        poses.append(tip(arms, name))
    return poses


def angle(a: Quaternion, b: Quaternion) -> float:
    return 2 * acos(min(1.0, abs(float(np.dot(a, b)))))


def test_move_cp_keeps_to_its_line_and_turns_evenly(arms: DirectControl) -> None:
    start, end = tip(arms), Pose(THERE, turn(30.0))
    poses = run_move(arms, end)
    way = np.subtract(end.position_m, start.position_m)
    whole = angle(start.quaternion_xyzw, end.quaternion_xyzw)
    for pose in poses:
        offset = np.subtract(pose.position_m, start.position_m)
        share = float(offset @ way / (way @ way))
        assert np.linalg.norm(offset - share * way) <= 1e-6
        assert angle(start.quaternion_xyzw, pose.quaternion_xyzw) == pytest.approx(
            share * whole, abs=1e-6
        )
    assert dist(poses[-1].position_m, THERE) <= 1e-6
    steps = [dist(a.position_m, b.position_m) for a, b in pairwise(poses)]
    assert max(steps) <= PARAMETERS.free_speed_m_s * DT_S * (1 + 1e-6)


def test_move_cp_may_turn_on_the_spot(arms: DirectControl) -> None:
    poses = run_move(arms, Pose(HOME_TIPS_M["psm1"], turn(-40.0)))
    assert max(dist(pose.position_m, HOME_TIPS_M["psm1"]) for pose in poses) <= 1e-6
    assert angle(poses[-1].quaternion_xyzw, turn(-40.0)) <= 1e-6


def test_two_arms_led_at_once_do_not_meet(arms: DirectControl) -> None:
    # Two jaws of 6 mm and the clearance of 2 mm: either may come half a millimetre nearer; not both
    for name, y in (("psm1", 0.06 - 0.00725), ("psm2", 0.06 + 0.00725)):
        run_move(arms, Pose((0.05, y, 0.06), KINEMATICS[name].tool_down_xyzw), name)
    before = dist(tip(arms).position_m, tip(arms, "psm2").position_m)
    for name, y in (("psm1", 0.06 - 0.00685), ("psm2", 0.06 + 0.00685)):
        wanted = Pose((0.05, y, 0.06), KINEMATICS[name].tool_down_xyzw)
        if name == "psm1":
            arms.servo_cp(name, wanted)
            continue
        fault = refusal(arms.servo_cp, name, wanted)
        assert fault.reason == fault.counted_as == "instrument_distance"
        assert fault.values["quantity"] == "distance to psm1, where it goes [m]"
    arms.tick(held=False)
    assert 0.014 <= dist(tip(arms).position_m, tip(arms, "psm2").position_m) < before


def test_a_move_to_where_the_arm_is_does_nothing(arms: DirectControl) -> None:
    arms.move_cp("psm1", tip(arms))
    assert not arms.busy("psm1")


@pytest.mark.parametrize(
    ("pose", "reason"),
    [
        (Pose((0.03, 0.02, -0.02), DOWN), "workspace"),
        (Pose((0.03, 0.02, 0.9), DOWN), "unreachable"),
        (Pose((0.05, -0.015, 0.03), DOWN), "workspace"),
        (Pose((0.05, 0.135, 0.03), DOWN), "instrument_distance"),  # psm2 is on its way
        (Pose(THERE, turn(180.0)), None),
    ],
)
def test_move_cp_out_of_bounds_is_refused_before_it_begins(
    arms: DirectControl, pose: Pose, reason: str | None
) -> None:
    if reason is None:
        run_move(arms, pose)
        return
    assert refusal(arms.move_cp, "psm1", pose).reason == reason
    assert not arms.busy("psm1")
    assert not arms.moving


def test_while_a_move_runs_other_commands_are_refused(arms: DirectControl) -> None:
    arms.move_cp("psm1", Pose(THERE, DOWN))
    arms.tick(held=False)
    for call, argument in (
        (arms.servo_jp, HOME["psm1"].joints),
        (arms.servo_cp, Pose(THERE, DOWN)),
        (arms.move_cp, Pose(THERE, DOWN)),
        (arms.servo_jaw, 1.0),
    ):
        assert refusal(call, "psm1", argument).reason == "busy"
    # The other arm is free.
    arms.servo_jaw("psm2", HOME["psm2"].jaw_rad - 0.03)


@pytest.mark.parametrize("how", ["pause", "disable", "held"])
def test_a_stop_brings_a_move_to_rest_within_two_ticks(arms: DirectControl, how: str) -> None:
    arms.move_cp("psm1", Pose((0.01, 0.02, 0.045), DOWN))
    for _ in range(25):
        arms.tick(held=False)
    before = tip(arms).position_m
    arms.tick(held=False)
    speed = dist(before, tip(arms).position_m) / DT_S
    assert speed == pytest.approx(PARAMETERS.free_speed_m_s, rel=1e-6)
    at_stop = tip(arms).position_m
    if how != "held":
        arms.state_command("psm1", how)
    for _ in range(2):
        arms.tick(held=how == "held")
    at_rest = tip(arms).position_m
    needed = speed**2 / (2 * PARAMETERS.stop_deceleration_m_s2)
    assert dist(at_stop, at_rest) <= needed * (1 + 1e-6)
    for _ in range(50):
        arms.tick(held=False)
    assert tip(arms).position_m == at_rest
    assert not arms.busy("psm1")


def test_what_was_wanted_while_held_is_dropped(arms: DirectControl) -> None:
    x, y, z = HOME_TIPS_M["psm1"]
    arms.servo_cp("psm1", Pose((x + 0.0005, y, z), DOWN))
    arms.tick(held=True)
    arms.tick(held=False)
    assert joints(arms) == HOME["psm1"].joints


@pytest.mark.parametrize("command", ["pause", "disable"])
def test_a_stopped_arm_follows_nothing_until_it_is_enabled(
    arms: DirectControl, command: str
) -> None:
    arms.state_command("psm1", command)
    for call, argument in (
        (arms.servo_jp, HOME["psm1"].joints),
        (arms.move_cp, Pose(THERE, DOWN)),
        (arms.servo_jaw, 1.0),
    ):
        assert refusal(call, "psm1", argument).reason == "wrong_state"
    arms.state_command("psm1", "resume" if command == "pause" else "enable")
    arms.servo_jp("psm1", HOME["psm1"].joints)


def test_an_arm_that_is_not_homed_does_not_move(arms: DirectControl) -> None:
    arms.state_command("psm1", "unhome")
    assert refusal(arms.servo_jp, "psm1", HOME["psm1"].joints).reason == "not_homed"
    arms.state_command("psm1", "home")
    arms.servo_jp("psm1", HOME["psm1"].joints)


def test_a_gate_that_ends_a_move_under_way_puts_the_arm_in_fault() -> None:
    calls = {"left": 10_000}

    def tripping(step: Step, bounds: Bounds) -> None:
        del step, bounds
        calls["left"] -= 1
        if calls["left"] < 0:
            raise GateRefused("tripping", "calls", 0.0, 0.0, 0.0)

    gates = {**DIRECT_GATES, "tripping": tripping}
    arms = DirectControl(
        PARAMETERS, KINEMATICS, simulated_drivers(PARAMETERS, KINEMATICS), HOME, gates
    )
    arms.move_cp("psm1", Pose(THERE, DOWN))
    calls["left"] = 5
    refused: list[CommandRefused] = []
    for _ in range(10):
        refused += arms.tick(held=False)
    assert [(one.arm, one.reason) for one in refused] == [("psm1", "tripping")]
    assert arms.status("psm1").state == "FAULT"
    assert not arms.busy("psm1")
    assert refusal(arms.servo_jp, "psm1", HOME["psm1"].joints).reason == "wrong_state"
    assert arms.state_command("psm1", "enable").state == "ENABLED"


def test_it_goes_on_from_where_a_trial_left_the_arms(arms: DirectControl) -> None:
    elsewhere = Setpoint(KINEMATICS["psm1"].inverse(Pose(THERE, DOWN)), 0.2)
    left = arms.snapshot(held=False)
    left["psm1"] = replace(
        left["psm1"],
        joints=elsewhere.joints,
        setpoint_joints=elsewhere.joints,
        jaw_rad=0.2,
        setpoint_jaw_rad=0.2,
    )
    drivers = simulated_drivers(PARAMETERS, KINEMATICS)
    drivers["psm1"].reset(elsewhere)
    drivers["psm2"].reset(HOME["psm2"])
    arms.take_over(left, drivers)
    assert dist(tip(arms).position_m, THERE) < 1e-9
    arms.servo_jaw("psm1", 0.22)
    arms.tick(held=False)
    assert arms.snapshot(held=False)["psm1"].jaw_rad == 0.22
    assert joints(arms) == elsewhere.joints


def test_slerp_is_the_shorter_turn_at_an_even_rate() -> None:
    generator = np.random.default_rng(4)
    for _ in range(200):
        a, b = (q / np.linalg.norm(q) for q in generator.normal(size=(2, 4)))
        start, end = tuple(a.tolist()), tuple(b.tolist())
        whole = angle(start, end)
        assert whole <= pi
        for share in (0.0, 0.25, 0.5, 1.0):
            between = slerp(start, end, share)
            assert angle(start, between) == pytest.approx(share * whole, abs=1e-7)
            assert angle(between, end) == pytest.approx((1 - share) * whole, abs=1e-7)


def test_the_length_of_a_path_counts_its_turn() -> None:
    here, turned = Pose(THERE, DOWN), Pose(THERE, turn(90.0))
    assert path_length(here, here) == 0.0
    assert path_length(here, turned) == pytest.approx(0.05 * pi / 2)
    assert path_length(here, Pose((0.03, 0.02, 0.015), DOWN)) == pytest.approx(0.03)
