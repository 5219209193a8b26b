import numpy as np
import pytest
from benchmarks import psm_reference as reference
from hypothesis import example, given, settings
from hypothesis import strategies as st

from fras_motion.kinematics import (
    BASES_IN_WORLD,
    JAW_LOWER_RAD,
    JAW_UPPER_RAD,
    JOINTS,
    ArmKinematics,
    Joints,
    Pose,
    Unreachable,
    matrix,
    quaternion,
)

AT_ORIGIN = ArmKinematics(Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)))
PLACED = {name: ArmKinematics(base) for name, base in BASES_IN_WORLD.items()}

within_limits = st.tuples(*(st.floats(joint.lower, joint.upper) for joint in JOINTS))


@pytest.mark.parametrize(
    ("joints", "position", "rotation"),
    [
        ((0, 0, 0, 0, 0, 0), (0, 0, 0.0065), [[0, 1, 0], [1, 0, 0], [0, 0, -1]]),
        ((0, 0, 0.1, 0, 0, 0), (0, 0, -0.0935), [[0, 1, 0], [1, 0, 0], [0, 0, -1]]),
        (
            (0.3, -0.2, 0.12, 0.5, 0.3, -0.4),
            (0.0317, 0.0202, -0.1067),
            [[0.474, 0.859, -0.193], [0.880, -0.458, 0.124], [0.018, -0.229, -0.973]],
        ),
    ],
)
def test_forward_gives_the_reference_vectors(joints, position, rotation):
    tip = AT_ORIGIN.forward(joints)
    assert tip.position_m == pytest.approx(position, abs=5e-5)
    np.testing.assert_allclose(matrix(tip.quaternion_xyzw), rotation, atol=5e-4)
    # What the benchmark and the log's tests hold motion against gives them, too.
    positions, rotations = reference.forward(np.array([joints], dtype=np.float64))
    np.testing.assert_allclose(positions[0], position, atol=5e-5)
    np.testing.assert_allclose(rotations[0], rotation, atol=5e-4)


@given(within_limits, st.sampled_from(sorted(PLACED)))
@settings(max_examples=200, deadline=None)
def test_forward_agrees_with_the_table_multiplied_out(joints, name):
    tip = PLACED[name].forward(joints)
    positions, rotations = reference.forward(np.array([joints]), reference.BASES[name])
    np.testing.assert_allclose(tip.position_m, positions[0], atol=1e-14)
    np.testing.assert_allclose(matrix(tip.quaternion_xyzw), rotations[0], atol=1e-13)


def test_limits_are_those_of_the_table():
    rows = [(j.lower, j.upper, j.speed, j.acceleration) for j in JOINTS]
    table = (reference.LOWER, reference.UPPER, reference.SPEED, reference.ACCELERATION)
    np.testing.assert_array_equal(rows, np.transpose(table))
    assert tuple(joint.name for joint in JOINTS) == reference.NAMES
    np.testing.assert_allclose((JAW_LOWER_RAD, JAW_UPPER_RAD), reference.JAW_RAD, rtol=1e-15)


def test_base_placement_moves_the_tip_rigidly():
    joints = (0.3, -0.2, 0.12, 0.5, 0.3, -0.4)
    alone = AT_ORIGIN.forward(joints)
    base = Pose((0.1, -0.2, 0.3), quaternion(matrix((0.1, 0.5, -0.3, np.sqrt(0.65)))))
    turned = matrix(base.quaternion_xyzw)
    placed = ArmKinematics(base).forward(joints)
    np.testing.assert_allclose(
        placed.position_m, turned @ alone.position_m + base.position_m, atol=1e-12
    )
    np.testing.assert_allclose(
        matrix(placed.quaternion_xyzw), turned @ matrix(alone.quaternion_xyzw), atol=1e-12
    )


@given(within_limits, st.sampled_from(sorted(PLACED)))
@settings(max_examples=100, deadline=None)
def test_jacobian_agrees_with_finite_differences(joints, name):
    arm, step = PLACED[name], 1e-6
    jacobian = arm.jacobian(joints)
    rotation = matrix(arm.forward(joints).quaternion_xyzw)
    for column in range(6):
        ahead, behind = list(joints), list(joints)
        ahead[column] += step
        behind[column] -= step
        a, b = arm.forward(tuple(ahead)), arm.forward(tuple(behind))
        linear = (np.array(a.position_m) - b.position_m) / (2 * step)
        spin = (matrix(a.quaternion_xyzw) - matrix(b.quaternion_xyzw)) / (2 * step) @ rotation.T
        angular = np.array(
            [spin[2, 1] - spin[1, 2], spin[0, 2] - spin[2, 0], spin[1, 0] - spin[0, 1]]
        )
        np.testing.assert_allclose(jacobian[:, column], [*linear, *(angular / 2)], atol=1e-7)


@given(within_limits, st.sampled_from(sorted(PLACED)))
@example((0.0, 0.5, 0.125, 4.53786, 1.0, 0.0), "psm1")
@settings(max_examples=300, deadline=None)
def test_inverse_of_forward_gives_the_joints_back(joints, name):
    arm = PLACED[name]
    found = arm.inverse(arm.forward(joints), near=joints)
    np.testing.assert_allclose(found, joints, atol=1e-9)


@given(
    st.tuples(st.floats(-0.1, 0.2), st.floats(-0.1, 0.2), st.floats(-0.1, 0.2)),
    st.tuples(*(st.floats(-1, 1),) * 4).filter(lambda q: sum(x * x for x in q) > 0.01),
)
@settings(max_examples=500, deadline=None)
def test_inverse_is_exact_within_limits_or_refuses_by_joint(position, direction):
    arm = PLACED["psm1"]
    norm = np.sqrt(sum(x * x for x in direction))
    asked = Pose(position, tuple(x / norm for x in direction))
    joints, refusal = None, None
    try:
        joints = arm.inverse(asked)
    except Unreachable as fault:
        refusal = fault
    if joints is None:
        assert refusal is not None
        assert refusal.joint in {joint.name for joint in JOINTS}
        assert not refusal.lower <= refusal.value <= refusal.upper
        return
    assert all(j.lower <= value <= j.upper for j, value in zip(JOINTS, joints, strict=True))
    reached = arm.forward(joints)
    np.testing.assert_allclose(reached.position_m, asked.position_m, atol=1e-9)
    np.testing.assert_allclose(
        matrix(reached.quaternion_xyzw), matrix(asked.quaternion_xyzw), atol=1e-9
    )


# The roll turns by more than a full turn: no pose is beyond its limits.
@pytest.mark.parametrize(
    ("joint", "beyond"),
    [
        *(
            (joint, sign * by)
            for joint, by in ((0, 1.7), (1, 1.0), (4, 1.45), (5, 1.45))
            for sign in (1, -1)
        ),
        (2, 0.245),
        (2, 0.055),
    ],
)
def test_inverse_names_the_joint_beyond_its_limit(joint, beyond):
    joints = [0.2, 0.1, 0.12, 0.3, 0.2, -0.1]
    inside = AT_ORIGIN.inverse(AT_ORIGIN.forward(as_joints(joints)))
    np.testing.assert_allclose(inside, joints, atol=1e-12)
    joints[joint] = beyond
    with pytest.raises(Unreachable) as refusal:
        AT_ORIGIN.inverse(AT_ORIGIN.forward(as_joints(joints)))
    assert refusal.value.joint == JOINTS[joint].name
    assert refusal.value.value == pytest.approx(beyond)
    assert (refusal.value.lower, refusal.value.upper) == (JOINTS[joint].lower, JOINTS[joint].upper)
    for part in (JOINTS[joint].name, f"{beyond:.4f}", f"{JOINTS[joint].upper:.4f}"):
        assert part in str(refusal.value)


def as_joints(values: list[float]) -> Joints:
    a, b, c, d, e, f = values
    return (a, b, c, d, e, f)


def test_shaft_folded_into_the_cannula_is_refused():
    with pytest.raises(Unreachable, match="insertion"):
        AT_ORIGIN.inverse(AT_ORIGIN.forward((0.0, 0.0, 0.05, 0.0, 0.0, 0.0)))


def test_poses_without_any_solution_are_refused():
    tip_z_sideways = (0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5))
    for position in [(0.0, 0.0, 0.0), (0.0, 0.0, -0.1), (0.0, 0.0, -0.0091)]:
        with pytest.raises(Unreachable):
            AT_ORIGIN.inverse(Pose(position, tip_z_sideways))
    with pytest.raises(Unreachable):
        AT_ORIGIN.inverse(Pose((np.nan, 0.0, 0.0), AT_ORIGIN.tool_down_xyzw))


def test_roll_stays_next_to_where_it_was():
    tip = AT_ORIGIN.forward((0.1, 0.1, 0.1, 3.3, 0.2, 0.2))
    assert AT_ORIGIN.inverse(tip)[3] == pytest.approx(3.3 - 2 * np.pi)
    assert AT_ORIGIN.inverse(tip, near=(0, 0, 0.1, 3.2, 0, 0))[3] == pytest.approx(3.3)
    # Next to 4.5 would be beyond the limit: the roll inside it is given.
    far = AT_ORIGIN.forward((0.1, 0.1, 0.1, -1.5, 0.2, 0.2))
    assert AT_ORIGIN.inverse(far, near=(0, 0, 0.1, 4.5, 0, 0))[3] == pytest.approx(-1.5)


@given(within_limits, st.sampled_from(sorted(PLACED)))
@settings(max_examples=100, deadline=None)
def test_shaft_always_passes_the_remote_centre(joints, name):
    arm = PLACED[name]
    origins = arm.joint_origins(joints)
    centre = np.array(arm.base_in_world.position_m)
    np.testing.assert_array_equal(origins[:2], [centre, centre])  # yaw and pitch turn about it
    shaft = origins[3] - origins[2]
    away = np.cross(shaft / np.linalg.norm(shaft), centre - origins[3])
    assert np.linalg.norm(away) < 1e-12
    # The wrist is past it by what is inserted, less what the table leaves outside.
    assert np.linalg.norm(origins[3] - centre) == pytest.approx(joints[2] - 0.0156, abs=1e-12)


@given(st.tuples(*(st.floats(-1, 1),) * 4).filter(lambda q: sum(x * x for x in q) > 0.01))
@example(values=(0.0, 1.0, 0.25, -1.0))  # two are the largest
@settings(max_examples=200, deadline=None)
def test_quaternion_and_matrix_are_inverses(values):
    norm = np.sqrt(sum(x * x for x in values))
    unit = np.array(values) / norm
    back = np.array(quaternion(matrix(tuple(unit.tolist()))))
    largest = np.abs(back) > np.abs(back).max() - 1e-12
    assert back[largest].max() > 0
    np.testing.assert_allclose(back * np.sign(back @ unit), unit, atol=1e-12)
