from dataclasses import replace
from math import inf, nan, radians

import pytest

from fras_motion.drivers import Setpoint
from fras_motion.kinematics import BASES_IN_WORLD, JOINTS, ArmKinematics, Instrument, Pose
from fras_motion.parameters import MotionParameters
from fras_motion.safety import (
    GATES,
    Box,
    GateRefused,
    Reaction,
    Step,
    force_relieved,
    joint_accelerations,
    required_reaction,
)

FORBIDDEN = Box((0.0, 0.0, -0.005), (0.02, 0.02, 0.03))
BOUNDS = MotionParameters(forbidden_boxes=(FORBIDDEN,)).bounds
ARM = ArmKinematics(BASES_IN_WORLD["psm1"])
TIP = Pose((0.05, 0.03, 0.06), ARM.tool_down_xyzw)
HERE = Setpoint(ARM.inverse(TIP), 1.0)
BODY = ARM.instrument(HERE.joints, TIP)
STAND = Step(0.02, HERE, HERE, TIP, TIP, ARM.tool_down_xyzw, BODY, BODY, {})


def moved(setpoint: Setpoint, joint: int, value: float) -> Setpoint:
    joints = list(setpoint.joints)
    joints[joint] = value
    a, b, c, d, e, f = joints
    return replace(setpoint, joints=(a, b, c, d, e, f))


def beyond(joint: int) -> Step:
    """A joint 1e-6 beyond its limit, coming from just inside."""
    upper = JOINTS[joint].upper
    return replace(STAND, before=moved(HERE, joint, upper), after=moved(HERE, joint, upper + 1e-6))


def turned(angle: float) -> Pose:
    x, y, _, _ = TIP.quaternion_xyzw
    half = angle / 2  # about the world's z, before the tool's own half turn
    return replace(TIP, quaternion_xyzw=(x - half * y, y + half * x, 0.0, 0.0))


def shifted(x: float, y: float = 0.0, z: float = 0.0) -> Instrument:
    """The instrument, as a whole elsewhere."""
    return Instrument(
        *((a + x, b + y, c + z) for a, b, c in (BODY.remote_centre_m, BODY.wrist_m, BODY.tip_m))
    )


# Two jaws of 6 mm and the clearance of 2 mm.
NEAREST = 0.014
LOST = Instrument(BODY.remote_centre_m, (nan, nan, nan), (nan, nan, nan))


# Each step offends one gate alone.
OFFENCES = {
    "finite": [
        replace(STAND, after=moved(HERE, 2, nan)),
        replace(STAND, after=replace(HERE, jaw_rad=inf)),
    ],
    "joint_limits": [beyond(joint) for joint in range(6)],
    "joint_speed": [
        replace(STAND, after=moved(HERE, joint, HERE.joints[joint] + sign * 0.0201 * rate.speed))
        for joint, rate in enumerate(JOINTS)
        for sign in (1, -1)
    ],
    "jaw_limits": [
        replace(
            STAND,
            before=replace(HERE, jaw_rad=radians(80)),
            after=replace(HERE, jaw_rad=radians(80.1)),
        ),
        replace(
            STAND,
            before=replace(HERE, jaw_rad=radians(-40)),
            after=replace(HERE, jaw_rad=radians(-40.1)),
        ),
    ],
    "jaw_speed": [replace(STAND, after=replace(HERE, jaw_rad=1.0 + 0.0401))],
    "workspace": [
        replace(STAND, tip_before=at, tip_after=at)
        for at in (
            replace(TIP, position_m=(0.1101, 0.03, 0.06)),
            replace(TIP, position_m=(0.05, -0.0101, 0.06)),
            replace(TIP, position_m=(0.05, 0.03, 0.0901)),
            replace(TIP, position_m=(0.05, 0.03, -0.0051)),
        )
    ],
    "cartesian_speed": [replace(STAND, tip_after=replace(TIP, position_m=(0.05101, 0.03, 0.06)))],
    "orientation": [replace(STAND, tip_after=turned(2e-6))],
    "instrument_distance": [
        replace(STAND, instrument_after=shifted(1e-6), others={"psm2": shifted(NEAREST)}),
        replace(STAND, instrument_before=shifted(-0.1), others={"psm2": shifted(0.0)}),
        replace(STAND, others={"psm3": shifted(1.0), "psm2": LOST}),
    ],
    "forbidden_box": [
        # The tip from above, and the shaft from the side.
        replace(STAND, instrument_after=shifted(-0.035, -0.015, -0.0241)),
        replace(STAND, instrument_after=shifted(-0.0261, -0.01, -0.075)),
        replace(STAND, instrument_before=LOST, instrument_after=LOST),
    ],
}
CASES = [(name, step) for name, steps in OFFENCES.items() for step in steps]


def test_every_gate_has_an_offence():
    assert list(OFFENCES) == list(GATES)


def test_rest_passes_every_gate():
    for gate in GATES.values():
        gate(STAND, BOUNDS)


@pytest.mark.parametrize(("name", "step"), CASES)
def test_gate_refuses_by_name_with_numbers(name, step):
    with pytest.raises(GateRefused) as refusal:
        GATES[name](step, BOUNDS)
    fault = refusal.value
    assert fault.gate == name
    assert not fault.lower <= fault.value <= fault.upper or name == "finite"
    assert name in str(fault)


@pytest.mark.parametrize(("name", "step"), [case for case in CASES if case[0] != "finite"])
def test_no_other_gate_would_have_refused(name, step):
    for other, gate in GATES.items():
        if other != name:
            gate(step, BOUNDS)


def test_gates_let_pass_what_is_just_allowed():
    step = replace(
        STAND,
        after=replace(HERE, jaw_rad=1.04),
        tip_after=replace(turned(5e-7), position_m=(0.051, 0.03, 0.06)),
    )
    for gate in GATES.values():
        gate(step, BOUNDS)


def test_instruments_may_be_as_near_as_the_clearance():
    GATES["instrument_distance"](replace(STAND, others={"psm2": shifted(NEAREST + 1e-9)}), BOUNDS)


@pytest.mark.parametrize("there", [shifted(0.010), shifted(-0.003, 0.006)])
def test_instruments_that_are_too_near_may_stand_and_part_but_not_approach(there):
    near = replace(STAND, others={"psm2": there})
    GATES["instrument_distance"](near, BOUNDS)
    away = 1 if there.tip_m[0] < BODY.tip_m[0] else -1
    GATES["instrument_distance"](replace(near, instrument_after=shifted(away * 1e-6)), BOUNDS)
    with pytest.raises(GateRefused, match=r"distance to psm2 \[m\] would be"):
        GATES["instrument_distance"](replace(near, instrument_after=shifted(away * -1e-6)), BOUNDS)


def test_instrument_in_a_box_may_leave_it_but_not_go_deeper():
    inside = replace(STAND, instrument_before=shifted(-0.035, -0.015, -0.026))
    deeper = replace(inside, instrument_after=shifted(-0.035, -0.015, -0.027))
    leaving = replace(inside, instrument_after=shifted(-0.035, -0.015, -0.025))
    GATES["forbidden_box"](leaving, BOUNDS)
    with pytest.raises(GateRefused, match=r"box \(0.0, 0.0, -0.005\) .. \(0.02, 0.02, 0.03\)"):
        GATES["forbidden_box"](deeper, BOUNDS)


def test_orientation_is_the_same_with_either_sign_of_the_quaternion():
    x, y, z, w = TIP.quaternion_xyzw
    step = replace(STAND, tip_after=replace(TIP, quaternion_xyzw=(-x, -y, -z, -w)))
    GATES["orientation"](step, BOUNDS)


def test_a_jump_to_nowhere_is_refused_by_speed_and_orientation_even_as_nan():
    lost = Pose((nan, nan, nan), (nan, nan, nan, nan))
    for name in ("workspace", "cartesian_speed", "orientation"):
        with pytest.raises(GateRefused):
            GATES[name](replace(STAND, tip_after=lost), BOUNDS)


@pytest.mark.parametrize("joint", range(6))
def test_planned_acceleration_is_bound(joint):
    limit = JOINTS[joint].acceleration * 0.02**2
    joint_accelerations(HERE, HERE, moved(HERE, joint, HERE.joints[joint] + 0.99 * limit), 0.02)
    with pytest.raises(GateRefused, match="joint_acceleration"):
        joint_accelerations(HERE, HERE, moved(HERE, joint, HERE.joints[joint] + 1.01 * limit), 0.02)


@pytest.mark.parametrize("action", ["reach", "grasp", "pull", "move"])
def test_reactions_to_the_verdict(action):
    assert required_reaction("ok", action) is Reaction.GO_ON
    soft = Reaction.RETREAT if action == "pull" else Reaction.GO_ON
    assert required_reaction("soft", action) is soft
    assert required_reaction("hard", action) is Reaction.RETREAT
    assert required_reaction("invalid", action) is Reaction.ABORT
    assert required_reaction("never heard of", action) is Reaction.ABORT


@pytest.mark.parametrize("level", ["ok", "soft", "hard", "invalid"])
def test_release_goes_on_at_any_level(level):
    assert required_reaction(level, "release") is Reaction.GO_ON


def test_force_is_relieved_below_the_ratio_only():
    assert force_relieved(0.475, 0.5, 0.95)
    assert not force_relieved(0.4751, 0.5, 0.95)
    assert not force_relieved(nan, 0.5, 0.95)
    # What is no number travels as a negative one.
    assert not force_relieved(-1.0, 0.5, 0.95)
