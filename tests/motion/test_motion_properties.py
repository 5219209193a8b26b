"""Whatever reachable actions are asked for: on the line, within the limits, the same each time."""

from itertools import groupby
from math import radians

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from fras_motion.controller import MotionController
from fras_motion.kinematics import BASES_IN_WORLD, JOINTS, matrix
from fras_motion.parameters import MotionParameters
from fras_motion.states import Goal, Verdict

PARAMETERS = MotionParameters(driver_time_constant_s=0.0)
DT = PARAMETERS.dt_s
# One arm each, so that it may go anywhere; both together: test_two_instruments.py.
ALONE = {arm: MotionController(PARAMETERS, {arm: base}) for arm, base in BASES_IN_WORLD.items()}
arms = st.sampled_from(["psm1", "psm2"])
points = st.tuples(st.floats(0.0, 0.1), st.floats(0.0, 0.12), st.floats(0.0, 0.03))


def play(controller, goals, verdict=None):
    """All snapshots of a sequence of goals, with the rest before it."""
    snapshots = [controller.snapshot]
    for goal in goals:
        controller.execute(goal)
        while controller.wants_tick:
            tick = controller.snapshot.tick
            judged = verdict(tick) if verdict else Verdict(tick, grasped={goal.arm: 4})
            snapshots.append(controller.advance(judged).snapshot)
    return snapshots


def retraction(arm, first, second):
    return [
        Goal("1", "reach", arm, None, first),
        Goal("2", "grasp", arm),
        Goal("3", "pull", arm),
        Goal("4", "move", arm, None, second),
        Goal("5", "release", arm),
        Goal("6", "reach", arm, None, second),
    ]


def check_limits(snapshots, arm):
    joints = np.array([s.arms[arm].setpoint_joints for s in snapshots])
    rows = [(j.lower, j.upper, j.speed, j.acceleration) for j in JOINTS]
    lower, upper, speed, acceleration = np.array(rows).T
    assert np.all((joints >= lower) & (joints <= upper))
    assert np.all(np.abs(np.diff(joints, axis=0)) <= speed * DT * (1 + 1e-6))
    assert np.all(np.abs(np.diff(joints, 2, axis=0)) <= acceleration * DT**2 * (1 + 1e-6) + 1e-13)
    jaw = np.array([s.arms[arm].setpoint_jaw_rad for s in snapshots])
    assert np.all((jaw >= radians(-40)) & (jaw <= radians(80)))
    assert np.abs(np.diff(jaw)).max() <= PARAMETERS.jaw_speed_rad_s * DT * (1 + 1e-6)


def check_line(snapshots, arm):
    tips = np.array([s.arms[arm].tip_in_world.position_m for s in snapshots])
    for order, limit in ((1, 0.05), (2, 0.2), (3, 4.0)):
        rates = np.linalg.norm(np.diff(tips, order, axis=0), axis=1)
        # Differences are means of the derivatives over their width, around a corner too.
        assert rates.max() <= limit * DT**order * (1 + 1e-6) + 1e-12
    down = matrix(ALONE[arm].arms[arm].tool_down_xyzw)
    for snapshot in snapshots:
        turned = matrix(snapshot.arms[arm].tip_in_world.quaternion_xyzw)
        assert np.abs(turned - down).max() <= 1e-6
    start = 0
    for _, leg in groupby(snapshots, key=lambda s: s.action and (s.action.goal_id, s.action.phase)):
        end = start + len(list(leg))
        away = tips[max(start - 1, 0) : end] - tips[max(start - 1, 0)]
        direction = away[-1] / (np.linalg.norm(away[-1]) + 1e-300)
        off = away - np.outer(away @ direction, direction)
        assert np.abs(off).max() <= 1e-6
        start = end


@given(arms, points, points)
@settings(max_examples=40, deadline=None)
def test_limits_are_never_exceeded_and_the_tip_stays_on_its_line(arm, first, second):
    controller = ALONE[arm]
    controller.reset()
    snapshots = play(controller, retraction(arm, first, second))
    np.testing.assert_allclose(snapshots[-1].arms[arm].tip_in_world.position_m, second, atol=1e-6)
    check_limits(snapshots, arm)
    check_line(snapshots, arm)


@given(arms, points, st.integers(0, 150))
@settings(max_examples=60, deadline=None)
def test_hold_at_any_tick_rests_within_two_ticks_and_the_braking_distance(arm, target, when):
    controller = ALONE[arm]
    controller.resume("page")
    controller.reset()
    controller.execute(Goal("1", "reach", arm, None, target))
    tips = [np.array(controller.snapshot.arms[arm].tip_in_world.position_m)]
    while controller.wants_tick and controller.snapshot.tick < when:
        snapshot = controller.advance(Verdict(controller.snapshot.tick)).snapshot
        tips.append(np.array(snapshot.arms[arm].tip_in_world.position_m))
    controller.hold("page", "stop")
    held = controller.snapshot.tick
    while controller.wants_tick:
        snapshot = controller.advance(Verdict(controller.snapshot.tick)).snapshot
    assert controller.snapshot.tick - held <= 2
    rest = np.array(controller.snapshot.arms[arm].tip_in_world.position_m)
    travelled = np.linalg.norm(rest - tips[-1])
    # The speed at the hold is at most the mean speed of the tick before plus what a tick adds.
    before = np.linalg.norm(tips[-1] - tips[-2]) / DT if len(tips) > 1 else 0.0
    speed = min(before + 0.2 * DT, 0.05)
    assert travelled <= speed**2 / (2 * 1.25) + 1e-9


def test_reset_controller_is_a_fresh_one_bit_for_bit():
    noisy = MotionParameters(driver_noise_rad=1e-5, driver_noise_m=1e-6, driver_seed=7)
    goals = retraction("psm2", (0.03, 0.09, 0.005), (0.06, 0.07, 0.005))

    def crossing(tick):
        hard = 200 < tick < 230
        return Verdict(tick, "soft" if hard else "ok", max_force_n=0.6, grasped={"psm2": 1})

    used = MotionController(noisy)
    play(used, retraction("psm1", (0.01, 0.01, 0.0), (0.09, 0.11, 0.01)))
    used.reset()
    first = play(used, goals, crossing)
    assert first == play(MotionController(noisy), goals, crossing)
    other = MotionController(MotionParameters(driver_noise_rad=1e-5, driver_seed=8))
    assert first != play(other, goals, crossing)
