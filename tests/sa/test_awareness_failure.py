"""Levels, parameters, bad states and targets, through the facade."""

import dataclasses
import math

import numpy as np
import pytest

from fras_sa.awareness import (
    ActionView,
    ArmView,
    Awareness,
    AwarenessParameters,
    BadParameter,
    MalformedModel,
    Memory,
    RobotView,
    TissueView,
    UnknownName,
    UnusableState,
)

FAR = np.array([0.0, 0.0, 0.3])
TICK = 0


def robot(name=None, phase="lift", tip=FAR, jaw=-0.3):
    action = None if name is None else ActionView(name, "psm1", "b(3,4)", phase)
    return RobotView(TICK, {"psm1": ArmView(tip, jaw), "psm2": ArmView(FAR, 1.0)}, action)


def tissue(model, force=0.0, *, lift=0.0, tool=(0.0, 0.0, 0.0), converged=True):
    return TissueView(
        tick=TICK,
        nodes_m=model.nodes_m + np.array([0.0, 0.0, lift]),
        max_force_n=force,
        tool_force_n={"psm1": np.array(tool), "psm2": np.zeros(3)},
        converged=converged,
    )


@pytest.mark.parametrize(
    ("name", "force", "level"),
    [
        ("pull", 0.5, "ok"),
        ("pull", np.nextafter(0.5, 1), "soft"),
        ("pull", 1.0, "soft"),
        ("pull", 1.01, "hard"),
        ("move", 0.99, "ok"),
        ("move", 1.01, "hard"),
        ("release", 1.01, "hard"),
        ("grasp", 0.6, "ok"),
        (None, 0.6, "ok"),
        (None, 1.01, "hard"),
    ],
)
def test_level_by_action_and_force(box, name, force, level):
    model = box()
    verdict = Awareness(AwarenessParameters(), model).judge(
        tissue(model, force), robot(name), Memory()
    )
    assert (verdict.level, verdict.ok) == (level, level == "ok")
    assert verdict.reason == {"ok": "", "soft": "force_soft", "hard": "force_hard"}[level]
    assert (verdict.force_n, verdict.limit_n) == (force, 0.5)


@pytest.mark.parametrize("phase", ["lift", "settle", "stop", "retreat", "held", "interrupted"])
def test_soft_in_any_phase_of_a_pull(box, phase):
    model = box()
    verdict = Awareness(AwarenessParameters(), model).judge(
        tissue(model, 0.6), robot("pull", phase), Memory()
    )
    assert verdict.level == "soft"
    assert verdict.max_height == ("psm1",)
    assert verdict.memory.max_height == {"psm1"}


def test_limits_are_parameters(box):
    model = box()
    sa = Awareness(AwarenessParameters(force_limit_n=0.2, hard_limit_n=0.3), model)
    levels = [sa.judge(tissue(model, f), robot("pull"), Memory()).level for f in (0.2, 0.25, 0.31)]
    assert levels == ["ok", "soft", "hard"]


def test_no_limit_reports_the_force_and_interrupts_nothing(box):
    model = box()
    sa = Awareness(AwarenessParameters(no_limit=True), model)
    verdict = sa.judge(tissue(model, 9.0), robot("pull"), Memory())
    assert (verdict.level, verdict.force_n, verdict.max_height) == ("ok", 9.0, ())
    stopped = sa.judge(tissue(model, 9.0, converged=False), robot("pull"), Memory())
    assert stopped.level == "invalid"
    evidence = sa.context(tissue(model, 9.0), robot(), Memory()).evidence["force"]
    assert (evidence["holds"], evidence["enforced"]) == (0.0, 0.0)


def test_the_tool_metric_takes_the_largest_of_the_arms(box):
    model = box()
    sa = Awareness(AwarenessParameters(force_metric="tool"), model)
    verdict = sa.judge(tissue(model, 9.0, tool=(0.3, 0.0, -0.4)), robot("pull"), Memory())
    assert (verdict.level, verdict.force_n) == ("ok", pytest.approx(0.5))
    crossing = tissue(model, 0.0, tool=(0.3, 0.1, -0.4))
    assert sa.judge(crossing, robot("pull"), Memory()).level == "soft"


def _with_nan(view):
    nodes = view.nodes_m.copy()
    nodes[17, 1] = math.nan
    return dataclasses.replace(view, nodes_m=nodes)


@pytest.mark.parametrize(
    "spoil",
    [
        _with_nan,
        lambda view: dataclasses.replace(view, nodes_m=view.nodes_m[:-1]),
        lambda view: dataclasses.replace(view, max_force_n=math.nan),
        lambda view: dataclasses.replace(view, max_force_n=math.inf),
        lambda view: dataclasses.replace(view, max_node_speed_m_s=math.inf),
        lambda view: dataclasses.replace(view, max_force_n=-1.0),
        lambda view: dataclasses.replace(view, max_node_speed_m_s=-1.0),
        lambda view: dataclasses.replace(
            view, tool_force_n={"psm1": np.zeros(3), "psm2": np.full(3, math.nan)}
        ),
    ],
)
@pytest.mark.parametrize("metric", ["nodal_max", "tool"])
def test_a_broken_tissue_state_is_invalid_and_gives_no_context(box, spoil, metric):
    model = box()
    sa = Awareness(AwarenessParameters(force_metric=metric), model)
    broken = spoil(tissue(model, 0.1))
    verdict = sa.judge(broken, robot("pull", "done"), Memory())
    assert (verdict.level, verdict.reason, verdict.visible) == ("invalid", "solver", False)
    assert not math.isinf(verdict.force_n)
    assert verdict.max_height == ()
    with pytest.raises(UnusableState, match="tick 0"):
        sa.context(broken, robot(), Memory())
    with pytest.raises(UnusableState):
        sa.target(broken, robot(), action="reach", arm="psm1", block="b(1,1)")


def test_an_unconverged_tick_is_invalid_but_its_kept_state_is_still_told(box):
    model = box()
    sa = Awareness(AwarenessParameters(), model)
    kept = tissue(model, 0.1, converged=False)
    verdict = sa.judge(kept, robot("pull"), Memory())
    assert (verdict.level, verdict.reason, verdict.visibility) == ("invalid", "solver", 0.0)
    assert "closed_gripper(psm1)" in sa.context(kept, robot(), Memory()).fluents


@pytest.mark.parametrize(
    "broken",
    [
        robot(tip=np.full(3, np.nan)),
        robot(jaw=math.nan),
        RobotView(TICK, robot().arms, ActionView("pull", "psm3", "b(1,1)", "lift")),
    ],
)
def test_a_broken_robot_state_is_invalid(box, broken):
    model = box()
    sa = Awareness(AwarenessParameters(), model)
    verdict = sa.judge(tissue(model), broken, Memory())
    assert (verdict.level, verdict.reason) == ("invalid", "robot")
    with pytest.raises(UnusableState, match="psm"):
        sa.context(tissue(model), broken, Memory())


def test_evidence_tells_what_is_missing_and_by_how_much(box):
    model = box()
    sa = Awareness(AwarenessParameters(), model)
    hidden = sa.context(tissue(model, 0.6), robot("pull"), Memory(frozenset({"psm1"})))
    assert "visible_roi" not in hidden.fluents
    assert hidden.evidence["visible_roi"] == {
        "holds": 0.0,
        "visible_fraction": 0.0,
        "threshold_fraction": 0.7,
        "margin_fraction": -0.7,
    }
    assert hidden.evidence["force"]["holds"] == 0.0
    assert hidden.evidence["force"]["margin_n"] == pytest.approx(-0.1)
    assert hidden.evidence["max_height(psm1)"]["force_n"] == 0.6
    seen = sa.context(tissue(model, lift=0.02), robot(), Memory())
    assert "visible_roi" in seen.fluents
    assert seen.evidence["visible_roi"]["margin_fraction"] == pytest.approx(0.3)
    for fluent in (*hidden.fluents, *seen.fluents):
        values = (hidden.evidence.get(fluent) or seen.evidence[fluent]).values()
        assert all(type(value) is float and math.isfinite(value) for value in values)


def test_visible_means_more_than_delta(box):
    model = box()
    fraction = (
        Awareness(AwarenessParameters(), model)
        .judge(tissue(model, lift=0.004), robot(), Memory())
        .visibility
    )
    for delta, visible in ((fraction, False), (np.nextafter(fraction, 0), True)):
        sa = Awareness(AwarenessParameters(visible_fraction=float(delta)), model)
        assert sa.judge(tissue(model, lift=0.004), robot(), Memory()).visible is visible


def test_a_context_never_shares_its_evidence_with_the_next(box):
    model = box(fixed=[(0.01, 0.01, 0.0)])
    sa = Awareness(AwarenessParameters(), model)
    first = sa.context(tissue(model), robot(), Memory())
    first.evidence["fixed(b(1,1))"]["fixed_points"] = -1.0
    second = sa.context(tissue(model), robot(), Memory())
    assert second.evidence["fixed(b(1,1))"] == {"fixed_points": 1.0}
    for array in (first.blocks_m, first.roi_m, first.fixed_points_m):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0


def test_targets(box):
    model = box()
    sa = Awareness(AwarenessParameters(), model)
    arms = robot(tip=np.array([0.01, 0.02, 0.044]))
    ask = {"arm": "psm1", "block": "b(3,4)"}
    reach = sa.target(tissue(model, lift=0.01), arms, action="reach", **ask)
    assert reach is not None
    np.testing.assert_allclose(reach, [0.25 / 7, 0.06, 0.015], atol=1e-12)
    move = sa.target(tissue(model, lift=0.01), arms, action="move", **ask)
    assert move is not None
    np.testing.assert_allclose(move, [0.25 / 7, 0.06, 0.044], atol=1e-12)
    for action in ("grasp", "release", "pull"):
        assert sa.target(tissue(model), arms, action=action, **ask) is None


@pytest.mark.parametrize(
    ("action", "arm", "block"),
    [("cut", "psm1", "b(1,1)"), ("reach", "psm3", "b(1,1)"), ("move", "psm1", "b(0,1)")],
)
def test_unknown_names_are_refused(box, action, arm, block):
    model = box()
    with pytest.raises(UnknownName):
        Awareness(AwarenessParameters(), model).target(
            tissue(model), robot(), action=action, arm=arm, block=block
        )


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("force_limit_n", 0.0),
        ("force_limit_n", math.nan),
        ("hard_limit_n", 0.4),
        ("hard_limit_n", math.inf),
        ("force_metric", "mean"),
        ("visible_distance_m", -0.01),
        ("visible_fraction", 1.0),
        ("closed_jaw_rad", math.nan),
        ("at_distance_m", 0.0),
        ("blocks", 0),
        ("sample_edge_m", math.inf),
    ],
)
def test_meaningless_parameters_are_refused_by_name(name, value):
    with pytest.raises(BadParameter, match=name):
        AwarenessParameters(**{name: value})


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("nodes_m", np.zeros((4, 2))),
        ("nodes_m", np.full((400, 3), np.nan)),
        ("triangles", np.zeros((0, 3), dtype=int)),
        ("triangles", np.array([[0, 1, 10_000]])),
        ("triangles", np.array([[0, 1, -1]])),
        ("fixed_points_m", np.zeros((2, 2))),
        ("roi_m", np.zeros(2)),
    ],
)
def test_a_malformed_model_is_refused_by_field(box, field, value):
    with pytest.raises(MalformedModel, match=field):
        Awareness(AwarenessParameters(), dataclasses.replace(box(), **{field: value}))
