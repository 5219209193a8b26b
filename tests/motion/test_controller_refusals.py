from math import hypot, inf, nan

import pytest

from fras_motion.controller import MotionController
from fras_motion.errors import InvalidParameter, Refused
from fras_motion.kinematics import BASES_IN_WORLD, Pose, Unreachable
from fras_motion.parameters import MotionParameters
from fras_motion.safety import GATES, GateRefused
from fras_motion.states import Goal, Verdict

TARGET = (0.02, 0.03, 0.005)
REACH = Goal("g", "reach", "psm1", None, TARGET)


def refusal(controller, goal):
    before = controller.snapshot
    with pytest.raises(Refused) as fault:
        controller.execute(goal)
    assert controller.snapshot == before
    assert f"({fault.value.reason})" in str(fault.value)
    return fault.value


@pytest.mark.parametrize(
    ("goal", "reason"),
    [
        (Goal("g", "dance", "psm1"), "unknown_action"),
        (Goal("g", "reach", "psm3", None, TARGET), "unknown_arm"),
        (Goal("g", "reach", "psm1"), "target_missing"),
        (Goal("g", "reach", "psm1", None, (nan, 0.03, 0.005)), "not_finite"),
        (Goal("g", "reach", "psm1", None, (0.02, inf, 0.005)), "not_finite"),
        (Goal("g", "pull", "psm1", None, (0.0, 0.0, nan)), "not_finite"),
        (Goal("g", "reach", "psm1", None, (0.02, 0.03, -0.02)), "workspace"),
        (Goal("g", "reach", "psm1", None, (0.2, 0.03, 0.005)), "workspace"),
        (Goal("g", "reach", "psm1", None, (0.02, 0.03, 0.08)), "workspace"),  # its via point
        (Goal("g", "pull", "psm1"), "jaw_open"),
        (Goal("g", "move", "psm1", None, TARGET), "jaw_open"),
    ],
)
def test_goal_is_refused_by_name_and_nothing_moves(ideal, goal, reason):
    assert refusal(ideal, goal).reason == reason
    assert not ideal.wants_tick
    ideal.execute(REACH)  # the next good one is accepted


def test_busy_controller_refuses_and_goes_on(ideal, run):
    ideal.execute(REACH)
    ideal.advance(Verdict(0))
    fault = refusal(ideal, Goal("other", "grasp", "psm2"))
    assert (fault.reason, fault.values["goal_id"]) == ("busy", "g")
    assert run(ideal)[-1].result.outcome == "succeeded"


@pytest.mark.parametrize("name", ["reach", "grasp"])
def test_closed_jaw_is_refused(holding, name):
    assert refusal(holding, Goal("g", name, "psm1", None, TARGET)).reason == "jaw_closed"


def test_move_needs_a_target(holding):
    assert refusal(holding, Goal("g", "move", "psm1")).reason == "target_missing"


def test_pull_above_the_workspace_is_refused(run):
    parameters = MotionParameters(driver_time_constant_s=0.0, lift_height_m=0.1)
    controller = MotionController(parameters)
    run(controller, REACH)
    run(controller, Goal("g", "grasp", "psm1"))
    fault = refusal(controller, Goal("g", "pull", "psm1"))
    assert (fault.reason, fault.values["upper"]) == ("workspace", 0.09)


def test_target_beyond_the_joints_is_refused_with_joint_and_bounds():
    wide = MotionParameters(workspace_lower_m=(-1, -1, -1), workspace_upper_m=(1, 1, 1))
    controller = MotionController(wide)
    fault = refusal(controller, Goal("g", "reach", "psm1", None, (0.05, 0.25, 0.0)))
    assert fault.reason == "unreachable"
    assert fault.values["joint"] == "insertion"
    # Above the target, at home's height: the wrist 9.1 mm short of (0, 0.25, 0.06 - 0.16).
    assert fault.values["value"] == pytest.approx(hypot(0.25 - 0.0091, 0.1) + 0.0156, abs=2e-3)
    assert (fault.values["lower"], fault.values["upper"]) == (0.0586, 0.24)


def test_way_that_cannot_be_timed_is_refused():
    controller = MotionController(MotionParameters(jerk_m_s3=1e-300))
    fault = refusal(controller, REACH)
    assert fault.reason == "profile"
    assert fault.values["distance"] == pytest.approx(0.03)


def test_path_that_fails_a_gate_half_way_is_refused_as_a_whole():
    def fence(step, bounds):
        del bounds
        if step.tip_after.position_m[0] > 0.07:
            raise GateRefused("fence", "x", step.tip_after.position_m[0], 0.0, 0.07)

    controller = MotionController(gates={**GATES, "fence": fence})
    fault = refusal(controller, Goal("g", "reach", "psm1", None, (0.09, 0.03, 0.005)))
    assert fault.reason == "fence"
    controller.execute(REACH)


def test_arm_that_cannot_be_at_home_is_refused():
    with pytest.raises(Unreachable):
        MotionController(bases_in_world={**BASES_IN_WORLD, "psm1": Pose((0, 0, 1), (0, 0, 0, 1))})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("dt_s", 0.0),
        ("dt_s", nan),
        ("free_speed_m_s", 0.06),  # could not be stopped within two ticks
        ("holding_speed_m_s", 0.06),
        ("jaw_speed_rad_s", 2.1),
        ("acceleration_m_s2", -1.0),
        ("settle_ticks", 0),
        ("driver_time_constant_s", -0.01),
        ("retreat_force_ratio", 1.1),
        ("jaw_open_rad", 0.2),
        ("jaw_open_rad", 1.5),
        ("jaw_closed_rad", 0.4),
        ("jaw_closed_rad", -1.0),
        ("workspace_upper_m", (0.1, -0.1, 0.09)),
        ("workspace_lower_m", (nan, 0.0, 0.0)),
    ],
)
def test_senseless_parameter_is_refused_by_name(name, value):
    with pytest.raises(InvalidParameter) as fault:
        MotionParameters(**{name: value})
    assert (fault.value.name, fault.value.allowed in str(fault.value)) == (name, True)
