import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fras_sim.fem import BadToolInput, ToolInput, box_mesh
from fras_sim.fem.grasp import JAW_CLOSED_RAD, move_arms, nodes_in_reach

MESH = box_mesh(node_counts=(11, 13, 2))
X = MESH.nodes_m
NO_NODE_FIXED = np.zeros(len(X), dtype=bool)
OPEN, CLOSED = 1.0, -0.3
POINTS = st.tuples(st.floats(-0.02, 0.12), st.floats(-0.02, 0.14), st.floats(-0.01, 0.02))


def moved(arms, **tools):
    inputs = {arm: ToolInput(np.array(tip_m), jaw) for arm, (tip_m, jaw) in tools.items()}
    return move_arms(arms, inputs, X, NO_NODE_FIXED, MESH.spacing_m)


@settings(max_examples=200, deadline=None)
@given(tip_m=POINTS, fixed=st.sets(st.integers(0, len(X) - 1), max_size=60))
def test_a_grasp_takes_what_the_rule_says(tip_m, fixed):
    allowed = np.ones(len(X), dtype=bool)
    allowed[list(fixed)] = False
    taken = nodes_in_reach(X, np.array(tip_m), allowed, MESH.spacing_m)
    distance_m = np.linalg.norm(X - tip_m, axis=1)
    distance_m[~allowed] = np.inf
    near = set(np.flatnonzero(distance_m <= 0.005 + 1e-9))
    if near:
        assert set(taken) == near
    elif distance_m.min() <= MESH.spacing_m + 1e-9:
        assert len(taken) == 1
        assert distance_m[taken[0]] == distance_m.min()
    else:
        assert len(taken) == 0


@settings(max_examples=100, deadline=None)
@given(first_m=POINTS, second_m=POINTS)
def test_two_arms_never_share_a_node(first_m, second_m):
    arms = moved({}, psm1=(first_m, OPEN), psm2=(second_m, OPEN))
    arms = moved(arms, psm1=(first_m, CLOSED), psm2=(second_m, CLOSED))
    assert not set(arms["psm1"].nodes) & set(arms["psm2"].nodes)


def test_radius_counts_as_within():
    mesh = box_mesh()
    node = 2 * (12 * 21 + 10) + 1
    taken = nodes_in_reach(
        mesh.nodes_m, mesh.nodes_m[node], np.ones(len(mesh.nodes_m), dtype=bool), mesh.spacing_m
    )
    # Itself, its four neighbours on the top face and the node below are all 5 mm away.
    assert len(taken) == 6


def test_closing_is_an_edge_at_twenty_degrees():
    tip_m = X[101]
    arms = moved({}, psm1=(tip_m, OPEN))
    arms = moved(arms, psm1=(tip_m, JAW_CLOSED_RAD))
    assert len(arms["psm1"].nodes) == 0
    arms = moved(arms, psm1=(tip_m, np.nextafter(JAW_CLOSED_RAD, 0)))
    held = arms["psm1"].nodes
    assert 101 in held
    away_m = tip_m + np.array([0.0, 0.0, 0.015])
    arms = moved(arms, psm1=(away_m, CLOSED))
    np.testing.assert_array_equal(arms["psm1"].nodes, held)
    np.testing.assert_allclose(arms["psm1"].nodes_at_m, X[held] + [0.0, 0.0, 0.015])
    arms = moved(arms, psm1=(away_m, JAW_CLOSED_RAD))
    assert len(arms["psm1"].nodes) == 0


def test_a_jaw_closed_when_first_seen_holds_nothing():
    arms = moved({}, psm1=(X[101], CLOSED))
    assert len(arms["psm1"].nodes) == 0
    arms = moved(arms, psm1=(X[101], CLOSED))
    assert len(arms["psm1"].nodes) == 0


def test_what_one_arm_lets_go_another_may_take_in_the_same_tick():
    arms = moved({}, psm1=(X[101], OPEN), psm2=(X[101], OPEN))
    arms = moved(arms, psm1=(X[101], OPEN), psm2=(X[101], CLOSED))
    held = arms["psm2"].nodes
    assert len(held)
    arms = moved(arms, psm1=(X[101], CLOSED), psm2=(X[101], OPEN))
    np.testing.assert_array_equal(arms["psm1"].nodes, held)
    assert len(arms["psm2"].nodes) == 0


@pytest.mark.parametrize(
    ("tip_m", "jaw"),
    [
        ([np.nan, 0.0, 0.0], OPEN),
        ([0.0, np.inf, 0.0], OPEN),
        ([0.0, 0.0], OPEN),
        ([0.0, 0.0, 0.0], np.nan),
    ],
)
def test_poses_that_are_not_numbers_are_refused(tip_m, jaw):
    with pytest.raises(BadToolInput, match="psm1"):
        moved({}, psm1=(tip_m, jaw))


def test_a_jump_is_refused_with_its_length():
    arms = moved({}, psm1=([0.0, 0.0, 0.0], OPEN))
    moved(arms, psm1=([0.0, 0.0, 0.02], OPEN))
    with pytest.raises(BadToolInput, match=r"21\.0 mm") as caught:
        moved(arms, psm1=([0.0, 0.0, 0.021], OPEN))
    assert caught.value.values["jump_m"] == pytest.approx(0.021)


def test_an_arm_that_holds_tissue_may_not_go_missing():
    arms = moved({}, psm1=(X[101], OPEN), psm2=([0.0, 0.0, 0.05], OPEN))
    arms = moved(arms, psm1=(X[101], CLOSED))
    assert set(arms) == {"psm1", "psm2"}
    with pytest.raises(BadToolInput, match="psm1 holds tissue"):
        moved(arms, psm2=([0.0, 0.0, 0.05], OPEN))
