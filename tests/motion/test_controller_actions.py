from itertools import groupby, pairwise
from math import dist, radians

import pytest

from fras_motion.controller import MotionController
from fras_motion.parameters import MotionParameters
from fras_motion.states import ActionResult, Goal, Verdict

TARGET = (0.02, 0.03, 0.005)
REACH = Goal("g1", "reach", "psm1", "b(2,2)", TARGET)
GRASP = Goal("g2", "grasp", "psm1", "b(2,2)")
PULL = Goal("g3", "pull", "psm1", "b(2,2)")


def phases(advances):
    return [name for name, _ in groupby(a.snapshot.action.phase for a in advances)]


def tip(controller, arm="psm1"):
    return controller.snapshot.arms[arm].tip_in_world.position_m


def test_tick_zero_is_rest_at_home():
    snapshot = MotionController().snapshot
    assert (snapshot.tick, snapshot.action, snapshot.verdict_tick) == (0, None, -1)
    assert snapshot.holds == {}
    for name, home in {"psm1": (0.05, 0.03, 0.06), "psm2": (0.05, 0.09, 0.06)}.items():
        arm = snapshot.arms[name]
        assert arm.tip_in_world.position_m == pytest.approx(home, abs=1e-12)
        assert arm.joints == arm.setpoint_joints
        assert arm.joint_velocities == (0.0,) * 6
        assert arm.jaw_rad == arm.setpoint_jaw_rad == pytest.approx(radians(60))
        assert arm.operating_state == "ENABLED"


def test_reach_rises_traverses_descends_and_settles(ideal, run):
    low = run(ideal, Goal("g0", "reach", "psm1", "b(4,4)", (0.05, 0.05, 0.005)))
    assert phases(low) == ["traverse", "descend", "settle", "done"]  # home is high enough
    advances = run(ideal, REACH)
    assert phases(advances) == ["rise", "traverse", "descend", "settle", "done"]
    assert tip(ideal) == pytest.approx(TARGET, abs=1e-9)
    last = advances[-1]
    assert last.result == ActionResult("g1", "succeeded", "", last.snapshot.tick)
    assert all(a.result is None for a in advances[:-1])
    settled = [a for a in advances if a.snapshot.action.phase in ("settle", "done")]
    assert len(settled) == MotionParameters().settle_ticks
    assert not ideal.wants_tick
    heights = [
        a.snapshot.arms["psm1"].tip_in_world.position_m[2]
        for a in advances
        if a.snapshot.action.phase == "traverse"
    ]
    assert min(heights) == pytest.approx(0.035, abs=1e-9)


def test_ticks_follow_each_other_and_name_their_verdict(ideal, run):
    advances = run(ideal, REACH) + run(ideal, GRASP)
    assert [a.snapshot.tick for a in advances] == list(range(1, len(advances) + 1))
    assert all(a.snapshot.verdict_tick == a.snapshot.tick - 1 for a in advances)


def test_ended_action_stays_visible_until_the_next_ones_first_tick(ideal, run):
    run(ideal, REACH)
    ideal.execute(GRASP)
    assert (ideal.snapshot.action.goal_id, ideal.snapshot.action.phase) == ("g1", "done")
    first = ideal.advance(Verdict(ideal.snapshot.tick)).snapshot.action
    assert (first.goal_id, first.name, first.arm, first.block, first.phase) == (
        "g2",
        "grasp",
        "psm1",
        "b(2,2)",
        "close",
    )


def test_reach_straight_up_or_down_needs_no_detour(ideal, run):
    run(ideal, REACH)
    assert phases(run(ideal, REACH)) == ["settle", "done"]
    down = Goal("g", "reach", "psm1", None, (0.02, 0.03, 0.003))
    assert phases(run(ideal, down)) == ["descend", "settle", "done"]


def test_whole_retraction_and_lateral_move(ideal, run):
    run(ideal, REACH)
    grasp = run(ideal, GRASP)
    assert phases(grasp) == ["close", "settle", "done"]
    assert ideal.snapshot.arms["psm1"].jaw_rad == pytest.approx(radians(-20))
    assert tip(ideal) == pytest.approx(TARGET, abs=1e-12)
    assert phases(run(ideal, PULL)) == ["lift", "settle", "done"]
    assert tip(ideal) == pytest.approx((0.02, 0.03, 0.055), abs=1e-9)
    moved = run(ideal, Goal("g4", "move", "psm1", "b(5,4)", (0.06, 0.05, 0.0)))
    assert phases(moved) == ["carry", "settle", "done"]
    assert tip(ideal) == pytest.approx((0.06, 0.05, 0.055), abs=1e-9)
    released = run(ideal, Goal("g5", "release", "psm1"))
    assert phases(released) == ["open", "settle", "done"]
    assert ideal.snapshot.arms["psm1"].jaw_rad == pytest.approx(radians(60))
    home = MotionController().snapshot.arms["psm2"]
    assert ideal.snapshot.arms["psm2"] == home  # the other arm stood still


def test_interrupted_pull_ends_at_the_same_height_when_taken_up_again(holding, run):
    holding.execute(PULL)
    for _ in range(40):
        holding.advance(Verdict(holding.snapshot.tick))
    holding.hold("page", "stop")
    run(holding)
    holding.resume("page")
    run(holding)
    assert 0.01 < tip(holding)[2] < 0.04
    run(holding, PULL)
    assert tip(holding)[2] == pytest.approx(0.055, abs=1e-9)
    assert phases(run(holding, PULL)) == ["settle", "done"]  # already there


def test_grasp_height_is_that_of_the_crossing_even_if_closing_was_stopped(ideal, run):
    run(ideal, REACH)
    ideal.execute(GRASP)
    while ideal.snapshot.arms["psm1"].jaw_rad >= radians(20):
        ideal.advance(Verdict(ideal.snapshot.tick))
    ideal.hold("page", "stop")
    run(ideal)
    ideal.resume("page")
    run(ideal)
    assert radians(-20) < ideal.snapshot.arms["psm1"].jaw_rad < radians(20)
    run(ideal, PULL)
    assert tip(ideal)[2] == pytest.approx(0.055, abs=1e-9)


def test_each_grasp_has_its_own_height(ideal, run):
    for height in (0.005, 0.012):
        run(ideal, Goal("r", "reach", "psm1", None, (0.03, 0.03, height)))
        run(ideal, GRASP)
        run(ideal, PULL)
        assert tip(ideal)[2] == pytest.approx(height + 0.05, abs=1e-9)
        run(ideal, Goal("o", "release", "psm1"))


def test_grasp_of_nothing_fails(ideal, run):
    run(ideal, REACH)
    nothing = run(ideal, GRASP, lambda s, n: Verdict(s.tick, grasped={"psm1": 0, "psm2": 3}))
    result = nothing[-1].result
    assert (result.outcome, result.reason) == ("failed", "nothing_in_reach")
    assert nothing[-1].snapshot.action.phase == "interrupted"
    assert run(ideal, Goal("g5", "release", "psm1"))[-1].result.outcome == "succeeded"


@pytest.mark.parametrize(("calm_after", "settling"), [(0, 5), (12, 13), (10_000, 100)])
def test_release_waits_for_the_tissue_but_not_for_ever(holding, run, calm_after, settling):
    seen = []

    def judge(snapshot, ticks):
        del ticks
        if snapshot.arms["psm1"].setpoint_jaw_rad == radians(60):
            seen.append(snapshot.tick)
        return Verdict(snapshot.tick, max_node_speed_m_s=0.0 if len(seen) > calm_after else 0.002)

    advances = run(holding, Goal("g5", "release", "psm1"), judge)
    settled = [a for a in advances if a.snapshot.action.phase in ("settle", "done")]
    assert len(settled) == settling
    assert advances[-1].result.outcome == "succeeded"


def test_speed_is_lower_with_tissue_in_hand(holding, run):
    def fastest(advances):
        tips = [a.snapshot.arms["psm1"].tip_in_world.position_m for a in advances]
        return max(dist(a, b) for a, b in pairwise(tips)) / 0.02

    assert fastest(run(holding, PULL)) == pytest.approx(0.02, rel=1e-6)
    run(holding, Goal("g5", "release", "psm1"))
    free = run(holding, Goal("g6", "reach", "psm1", None, (0.09, 0.11, 0.005)))
    assert fastest(free) == pytest.approx(0.05, rel=1e-6)


def test_measured_arm_lags_and_has_settled_at_the_end(run):
    controller = MotionController()
    advances = run(controller, REACH)
    lags = [
        max(abs(a - b) for a, b in zip(arm.joints, arm.setpoint_joints, strict=True))
        for arm in (a.snapshot.arms["psm1"] for a in advances)
    ]
    assert max(lags) > 1e-4
    assert lags[-1] < 1e-6
    assert tip(controller) == pytest.approx(TARGET, abs=1e-6)
