"""Two arms in one cell, and boxes that no instrument may enter: refused before anything moves."""

from math import inf

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fras_motion.controller import MotionController
from fras_motion.errors import InvalidParameter, Refused
from fras_motion.kinematics import HOME_TIPS_M
from fras_motion.parameters import MotionParameters
from fras_motion.safety import Box, box_distance_m, instrument_distance_m
from fras_motion.states import Goal, Verdict
from support.turning import turn

PARAMETERS = MotionParameters(driver_time_constant_s=0.0)
BOTH = MotionController(PARAMETERS)
BOX = Box((0.06, 0.0, 0.0), (0.08, 0.06, 0.02))
CLEARANCE = PARAMETERS.instrument_clearance_m


def instruments(snapshot):
    return [
        BOTH.arms[name].instrument(arm.joints, arm.tip_in_world)
        for name, arm in snapshot.arms.items()
    ]


def distance(snapshot):
    return instrument_distance_m(*instruments(snapshot))


def refusal(controller, goal):
    before = controller.snapshot
    with pytest.raises(Refused) as fault:
        controller.execute(goal)
    assert controller.snapshot == before
    assert not controller.wants_tick
    return fault.value


def numbers(fault: Refused) -> list[float]:
    return [float(str(fault.values[name])) for name in ("value", "lower", "upper")]


@pytest.mark.parametrize(
    "target",
    [
        (0.05, 0.03, 0.055),  # the other jaws
        (0.05, 0.042, 0.05),  # nearer than both jaws are wide, and the clearance
        (0.05, 0.0, 0.03),  # behind it: the way leads through the other arm
    ],
)
def test_goal_through_the_other_arm_is_refused_with_the_numbers(ideal, target):
    fault = refusal(ideal, Goal("g", "reach", "psm2", None, target))
    assert fault.reason == "instrument_distance"
    assert fault.values["quantity"] == "distance to psm1 [m]"
    value, lower, upper = numbers(fault)
    assert value < lower == CLEARANCE
    assert upper == inf


def test_arm_may_go_where_the_other_one_has_left(ideal, run):
    behind = Goal("g", "reach", "psm2", None, (0.05, 0.03, 0.03))
    assert refusal(ideal, behind).reason == "instrument_distance"
    run(ideal, Goal("g", "reach", "psm1", None, (0.0, 0.0, 0.03)))
    assert run(ideal, behind)[-1].result.outcome == "succeeded"


@pytest.mark.parametrize("arm", ["psm1", "psm2"])
def test_arms_too_near_to_each_other_can_part(run, arm):
    near = MotionController(
        MotionParameters(driver_time_constant_s=0.0, instrument_clearance_m=0.02),
        home_tips_m={"psm1": (0.05, 0.05, 0.03), "psm2": (0.05, 0.07, 0.03)},
    )
    assert distance(near.snapshot) == pytest.approx(0.008, abs=1e-4)
    across = 0.01 if arm == "psm2" else -0.01
    nearer = Goal("g", "reach", arm, None, (0.05, 0.06 - across / 2, 0.03))
    assert refusal(near, nearer).reason == "instrument_distance"
    apart = Goal("g", "reach", arm, None, (0.05, 0.06 + 4 * across, 0.03))
    assert run(near, apart)[-1].result.outcome == "succeeded"
    assert distance(near.snapshot) > 0.02


@pytest.mark.parametrize(
    ("arm", "target"),
    [
        ("psm1", (0.07, 0.03, 0.005)),  # in the box
        ("psm1", (0.07, 0.064, 0.005)),  # beside it, by less than the jaws are wide
        ("psm2", (0.07, 0.05, 0.024)),  # above it, by less than the jaws are wide
    ],
)
def test_goal_in_a_forbidden_box_is_refused_with_box_and_numbers(arm, target):
    controller = MotionController(MotionParameters(forbidden_boxes=(BOX,)))
    fault = refusal(controller, Goal("g", "reach", arm, None, target))
    assert fault.reason == "forbidden_box"
    assert fault.values["quantity"] == f"distance to the box {BOX.lower_m} .. {BOX.upper_m} [m]"
    value, lower, _ = numbers(fault)
    assert value < lower == 0.0


def test_shaft_may_not_enter_a_forbidden_box_either(run):
    # psm1's shaft leans over this box when the tip is beyond it.
    box = Box((0.03, 0.028, 0.06), (0.07, 0.04, 0.08))
    goal = Goal("g", "reach", "psm1", None, (0.05, 0.1, 0.03))
    there = [Goal("1", "reach", "psm2", None, (0.0, 0.12, 0.0)), goal]
    free = MotionController(PARAMETERS)
    for one in there:
        assert run(free, one)[-1].result.outcome == "succeeded"
    shut = MotionController(
        MotionParameters(driver_time_constant_s=0.0, forbidden_boxes=(box,)),
        home_tips_m={**HOME_TIPS_M, "psm1": (0.05, 0.0, 0.06)},
    )
    assert run(shut, there[0])[-1].result.outcome == "succeeded"
    assert refusal(shut, goal).reason == "forbidden_box"


def test_box_around_a_home_is_refused_when_the_trial_begins():
    with pytest.raises(InvalidParameter, match="forbidden_boxes"):
        MotionController(MotionParameters(forbidden_boxes=(Box((0, 0, 0), (0.1, 0.1, 0.08)),)))


goals = st.tuples(
    st.sampled_from(["psm1", "psm2"]),
    st.sampled_from(["reach", "grasp", "pull", "move", "release"]),
    st.tuples(st.floats(0.03, 0.07), st.floats(0.03, 0.09), st.floats(0.0, 0.03)),
)


@given(st.lists(goals, min_size=4, max_size=8), st.integers(0, 400))
@settings(max_examples=40, deadline=None)
def test_whatever_is_asked_the_instruments_stay_apart_and_out_of_the_box(asked, crossing):
    box = Box((0.045, 0.055, 0.0), (0.055, 0.065, 0.01))
    controller = MotionController(
        MotionParameters(driver_time_constant_s=0.0, forbidden_boxes=(box,))
    )

    def judge(snapshot, ticks):
        del ticks
        level = "soft" if crossing <= snapshot.tick < crossing + 20 else "ok"
        return Verdict(snapshot.tick, level, max_force_n=0.6, grasped={"psm1": 4, "psm2": 4})

    for number, (arm, name, target) in enumerate(asked):
        try:
            advances = turn(controller, Goal(str(number), name, arm, None, target), judge)
        except Refused:
            continue
        for advance in advances:
            assert distance(advance.snapshot) >= CLEARANCE - 1e-9
            for instrument in instruments(advance.snapshot):
                assert box_distance_m(instrument, box.lower_m, box.upper_m) >= -1e-6
