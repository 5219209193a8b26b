from itertools import groupby
from math import dist, inf, nan

import pytest

from fras_motion.controller import MotionController
from fras_motion.errors import NoTickWanted, Refused, StaleVerdict
from fras_motion.safety import GATES, GateRefused
from fras_motion.states import ActionResult, Goal, Verdict

REACH = Goal("g1", "reach", "psm1", "b(6,6)", (0.09, 0.05, 0.005))
PULL = Goal("g3", "pull", "psm1", "b(2,2)")
RELEASE = Goal("g5", "release", "psm1")
STOP_M_S2 = 1.25


def phases(advances):
    return [name for name, _ in groupby(a.snapshot.action.phase for a in advances)]


def tick(controller, number=1, **verdict):
    advances = [
        controller.advance(Verdict(controller.snapshot.tick, **verdict)) for _ in range(number)
    ]
    return advances[-1]


def tip(controller, arm="psm1"):
    return controller.snapshot.arms[arm].tip_in_world.position_m


def end(advances):
    result = advances[-1].result
    return result.outcome, result.reason


@pytest.mark.parametrize("when", [1, 5, 25, 52, 60, 100, 128])
def test_hold_brings_the_arm_to_rest_within_two_ticks(ideal, run, when):
    ideal.execute(REACH)
    tick(ideal, when)
    before = tip(ideal)
    ideal.hold("page", "stop")
    stopping = run(ideal)
    assert len(stopping) <= 2
    assert set(phases(stopping)) <= {"stop", "held"}
    assert dist(before, tip(ideal)) <= 0.05**2 / (2 * STOP_M_S2) + 1e-9
    assert not ideal.wants_tick
    assert ideal.snapshot.action.phase == "held"
    assert ideal.snapshot.holds == {"page": "stop"}
    assert ideal.snapshot.arms["psm1"].operating_state == "PAUSED"
    with pytest.raises(NoTickWanted, match="held by page"):
        tick(ideal)


def test_stop_travels_what_the_deceleration_needs(ideal, run):
    ideal.execute(REACH)
    tick(ideal, 25)  # at full speed
    before = tip(ideal)
    ideal.hold("page", "stop")
    assert len(run(ideal)) == 2
    assert dist(before, tip(ideal)) == pytest.approx(0.05**2 / (2 * STOP_M_S2), abs=1e-9)


def test_lifting_the_last_hold_ends_the_action_with_one_tick_at_rest(ideal, run):
    ideal.execute(REACH)
    tick(ideal, 25)
    ideal.hold("page", "stop")
    ideal.hold("cli", "me too")
    run(ideal)
    where = tip(ideal)
    assert ideal.resume("page")
    assert not ideal.wants_tick
    assert not ideal.resume("page")
    assert ideal.resume("cli")
    ending = run(ideal)
    assert phases(ending) == ["interrupted"]
    assert end(ending) == ("interrupted", "hold")
    assert tip(ideal) == where
    assert ideal.snapshot.arms["psm1"].operating_state == "ENABLED"
    assert run(ideal, REACH)[-1].result.outcome == "succeeded"


def test_hold_lifted_before_rest_still_ends_the_action(ideal, run):
    ideal.execute(REACH)
    tick(ideal, 25)
    ideal.hold("page", "stop")
    ideal.resume("page")
    ending = run(ideal)
    assert phases(ending) == ["stop", "interrupted"]
    assert end(ending) == ("interrupted", "hold")


def test_goal_accepted_while_held_ends_when_the_hold_is_lifted(ideal, run):
    ideal.hold("recorder", "full")
    ideal.execute(REACH)
    assert not ideal.wants_tick
    assert ideal.snapshot.action.phase == "held"
    where = tip(ideal)
    ideal.resume("recorder")
    ending = run(ideal)
    assert end(ending) == ("interrupted", "hold")
    assert tip(ideal) == where
    assert ideal.snapshot.tick == 1


def test_hold_while_settling_stops_the_clock_at_once(ideal, run):
    ideal.execute(REACH)
    while ideal.snapshot.action is None or ideal.snapshot.action.phase != "settle":
        tick(ideal)
    ideal.hold("page", "stop")
    assert not ideal.wants_tick
    ideal.resume("page")
    assert end(run(ideal)) == ("interrupted", "hold")


def test_hold_stops_a_jaw_within_two_ticks(holding, run):
    holding.execute(RELEASE)
    tick(holding, 20)
    holding.hold("page", "stop")
    assert len(run(holding)) <= 2
    jaw = holding.snapshot.arms["psm1"].jaw_rad
    holding.resume("page")
    assert end(run(holding)) == ("interrupted", "hold")
    assert holding.snapshot.arms["psm1"].jaw_rad == jaw


def test_soft_crossing_in_a_pull_stops_and_retreats_until_relieved(holding, run, from_tick):
    # The force grows with the height: the limit of 0.5 N is crossed at 20 mm.
    def judge(snapshot, ticks):
        del ticks
        height = snapshot.arms["psm1"].tip_in_world.position_m[2] - 0.005
        force = 0.5 * height / 0.02
        return Verdict(snapshot.tick, "soft" if force > 0.5 else "ok", max_force_n=force)

    advances = run(holding, PULL, judge)
    assert phases(advances) == ["lift", "stop", "retreat", "interrupted"]
    assert end(advances) == ("interrupted", "force_soft")
    height = tip(holding)[2] - 0.005
    assert 0.0185 < height <= 0.019  # 0.95 of the limit is at 19 mm
    assert tip(holding)[:2] == pytest.approx((0.02, 0.03), abs=1e-9)
    heights = [a.snapshot.arms["psm1"].tip_in_world.position_m[2] - 0.005 for a in advances]
    assert max(heights) <= 0.02 + 3 * 0.02 * 0.02
    assert sum(height > 0.02 for height in heights) <= 5
    assert not holding.hard_latched


def test_retreat_is_at_most_five_millimetres(holding, run, from_tick):
    advances = run(holding, PULL, from_tick(100, level="soft", max_force_n=0.6))
    heights = [a.snapshot.arms["psm1"].tip_in_world.position_m[2] for a in advances]
    assert max(heights) - heights[-1] == pytest.approx(0.005, abs=1e-9)
    assert end(advances) == ("interrupted", "force_soft")


def test_retreat_ends_at_the_start_of_the_way(holding, run, from_tick):
    advances = run(holding, PULL, from_tick(10, level="soft", max_force_n=0.6))
    assert phases(advances) == ["lift", "stop", "retreat", "interrupted"]
    assert tip(holding)[2] == pytest.approx(0.005, abs=1e-9)


def test_no_retreat_is_needed_when_the_stop_relieved_the_force(holding, run):
    def judge(snapshot, ticks):
        if ticks == 50:
            return Verdict(snapshot.tick, "soft", max_force_n=0.51)
        return Verdict(snapshot.tick, max_force_n=0.4)

    advances = run(holding, PULL, judge)
    assert phases(advances) == ["lift", "stop", "interrupted"]
    assert end(advances) == ("interrupted", "force_soft")


def test_crossing_while_a_pull_settles_retreats_too(holding, run):
    def judge(snapshot, ticks):
        del ticks
        settling = snapshot.action.phase in ("settle", "retreat")
        return Verdict(snapshot.tick, "soft" if settling else "ok", max_force_n=0.6)

    advances = run(holding, PULL, judge)
    assert phases(advances) == ["lift", "settle", "retreat", "interrupted"]
    assert end(advances) == ("interrupted", "force_soft")
    assert tip(holding)[2] == pytest.approx(0.05, abs=1e-9)


def test_soft_binds_no_other_action(holding, run, from_tick):
    moved = run(
        holding,
        Goal("g4", "move", "psm1", None, (0.06, 0.05, 0.0)),
        from_tick(0, level="soft", max_force_n=0.6),
    )
    assert end(moved) == ("succeeded", "")


@pytest.mark.parametrize("name", ["reach", "pull", "move"])
def test_hard_crossing_retreats_and_only_release_is_accepted(holding, run, from_tick, name):
    # psm1 holds tissue; psm2 reaches, so that any arm's action can cross the limit.
    goal = {
        "reach": Goal("g", "reach", "psm2", None, (0.05, 0.1, 0.005)),
        "pull": PULL,
        "move": Goal("g", "move", "psm1", None, (0.06, 0.05, 0.0)),
    }[name]
    advances = run(holding, goal, from_tick(30, level="hard", max_force_n=1.2))
    assert phases(advances)[-3:] == ["stop", "retreat", "interrupted"]
    assert end(advances) == ("interrupted", "force_hard")
    assert holding.hard_latched
    for other in (goal, PULL, Goal("g", "grasp", "psm2")):
        with pytest.raises(Refused, match="hard_latch") as refusal:
            holding.execute(other)
        assert refusal.value.reason == "hard_latch"
    # A release that is stopped does not count.
    holding.execute(RELEASE)
    tick(holding, 5, level="hard", max_force_n=1.2)
    holding.hold("page", "stop")
    holding.resume("page")
    run(holding)
    assert holding.hard_latched
    released = run(holding, RELEASE, from_tick(0, level="hard", max_force_n=1.2))
    assert end(released) == ("succeeded", "")
    assert not holding.hard_latched
    assert end(run(holding, Goal("g", "reach", "psm1", None, (0.05, 0.05, 0.005)))) == (
        "succeeded",
        "",
    )


def test_hard_crossing_while_grasping_stops_the_jaw(ideal, run, from_tick):
    run(ideal, REACH)
    advances = run(ideal, Goal("g2", "grasp", "psm1"), from_tick(20, level="hard", max_force_n=2.0))
    assert phases(advances) == ["close", "stop", "interrupted"]
    assert end(advances) == ("interrupted", "force_hard")
    assert ideal.hard_latched


def test_hard_before_the_first_tick_moves_nothing(holding, run, from_tick):
    where = tip(holding)
    advances = run(holding, PULL, from_tick(0, level="hard", max_force_n=2.0))
    assert (phases(advances), len(advances)) == (["interrupted"], 1)
    assert tip(holding) == where


@pytest.mark.parametrize(("reason", "named"), [("", "hold:solver"), ("stale", "hold:stale")])
def test_invalid_verdict_aborts(holding, run, from_tick, reason, named):
    advances = run(holding, PULL, from_tick(40, level="invalid", reason=reason))
    assert phases(advances) == ["lift", "interrupted"]  # 20 mm/s: at rest within one tick
    assert end(advances) == ("aborted", named)
    assert advances[-1].snapshot.tick == advances[0].snapshot.tick + 40


def test_invalid_verdict_overrides_a_running_retreat_but_does_not_end_it(holding, run):
    def judge(snapshot, ticks):
        level = "ok" if ticks < 100 else "soft" if ticks < 105 else "invalid"
        return Verdict(snapshot.tick, level, max_force_n=nan if level == "invalid" else 0.6)

    advances = run(holding, PULL, judge)
    heights = [a.snapshot.arms["psm1"].tip_in_world.position_m[2] for a in advances]
    assert end(advances) == ("aborted", "hold:solver")
    assert max(heights) - heights[-1] == pytest.approx(0.005, abs=1e-9)


@pytest.mark.parametrize("level", ["soft", "hard", "invalid"])
def test_release_runs_at_any_level(holding, run, from_tick, level):
    verdict = from_tick(0, level=level, max_force_n=inf)
    assert end(run(holding, RELEASE, verdict)) == ("succeeded", "")


def test_hold_during_a_retreat_stops_it_for_good(holding, run):
    holding.execute(PULL)
    tick(holding, 100)
    tick(holding, 5, level="soft", max_force_n=0.6)
    assert holding.snapshot.action.phase == "retreat"
    holding.hold("page", "stop")
    assert len(run(holding)) <= 2
    where = tip(holding)
    holding.resume("page")
    ending = run(holding)
    assert end(ending) == ("interrupted", "force_soft")  # the first cause names the end
    assert tip(holding) == where


def test_hold_between_stop_and_retreat_forgoes_the_retreat(holding, run):
    holding.execute(PULL)
    tick(holding, 100)
    assert tick(holding, 1, level="soft", max_force_n=0.6).snapshot.action.phase == "stop"
    holding.hold("page", "stop")
    assert not holding.wants_tick
    where = tip(holding)
    holding.resume("page")
    ending = [tick(holding, 1, level="soft", max_force_n=0.6)]
    assert end(ending) == ("interrupted", "force_soft")
    assert tip(holding) == where


def test_verdict_on_another_tick_moves_nothing(ideal):
    ideal.execute(REACH)
    tick(ideal, 3)
    before = ideal.snapshot
    for other in (2, 4, -1):
        with pytest.raises(StaleVerdict) as fault:
            ideal.advance(Verdict(other))
        assert (fault.value.expected, fault.value.got) == (3, other)
    assert ideal.snapshot == before


def test_idle_controller_wants_no_tick(ideal):
    assert not ideal.wants_tick
    with pytest.raises(NoTickWanted, match="no action runs"):
        tick(ideal)


def test_abort_ends_the_action_without_a_tick(ideal, run):
    assert ideal.abort("hold:sim") is None
    ideal.execute(REACH)
    tick(ideal, 25)
    setpoint = ideal.snapshot.arms["psm1"].setpoint_joints
    assert ideal.abort("hold:sim") == ActionResult("g1", "aborted", "hold:sim", 25)
    assert not ideal.wants_tick
    assert ideal.snapshot.tick == 25
    assert ideal.snapshot.action.phase == "interrupted"
    assert ideal.snapshot.arms["psm1"].setpoint_joints == setpoint
    assert end(run(ideal, REACH)) == ("succeeded", "")


def test_abort_of_a_held_action_leaves_the_hold(ideal, run):
    ideal.execute(REACH)
    tick(ideal, 25)
    ideal.hold("page", "stop")
    run(ideal)
    assert ideal.abort("hold:page:stop").outcome == "aborted"
    assert ideal.snapshot.holds == {"page": "stop"}


def test_reset_keeps_the_holds_and_forgets_the_rest(holding, run, from_tick):
    run(holding, PULL, from_tick(30, level="hard", max_force_n=1.2))
    holding.hold("page", "stop")
    snapshot = holding.reset()
    assert snapshot.holds == {"page": "stop"}
    assert (snapshot.tick, snapshot.action) == (0, None)
    assert not holding.hard_latched
    with pytest.raises(Refused, match="jaw_open"):
        holding.execute(PULL)


def test_setpoint_that_fails_a_gate_is_not_sent_and_ends_the_action():
    armed = []

    def trap(step, bounds):
        del bounds
        if armed:
            raise GateRefused("trap", "height", step.tip_after.position_m[2], 0.0, 0.0)

    controller = MotionController(gates={**GATES, "trap": trap})
    controller.execute(REACH)
    tick(controller, 25)
    setpoint = controller.snapshot.arms["psm1"].setpoint_joints
    armed.append(True)
    last = tick(controller)
    assert end([last]) == ("aborted", "gate:trap")
    assert phases([last]) == ["interrupted"]
    assert last.snapshot.arms["psm1"].setpoint_joints == setpoint
    assert not controller.wants_tick


@pytest.mark.parametrize("first", ["soft", "held"])
def test_hard_crossing_while_stopping_is_latched_and_names_the_end(holding, run, first):
    holding.execute(PULL)
    tick(holding, 30)
    if first == "soft":
        tick(holding, 1, level="soft", max_force_n=0.6)
    else:
        holding.hold("page", "stop")
    tick(holding, 1, level="hard", max_force_n=1.2)
    holding.resume("page")
    advances = run(holding)
    assert end(advances) == ("interrupted", "force_hard")
    assert holding.hard_latched


def test_latch_is_lifted_by_the_arm_that_holds_the_tissue(holding, run, from_tick):
    run(holding, PULL, from_tick(30, level="hard", max_force_n=1.2))
    assert end(run(holding, Goal("g", "release", "psm2"))) == ("succeeded", "")
    assert holding.hard_latched
    with pytest.raises(Refused, match="hard_latch"):
        holding.execute(PULL)
    run(holding, RELEASE)
    assert not holding.hard_latched
