"""The force's trend: rate, prediction of the crossing, stale states; all through `judge`."""

import math
import statistics
from collections.abc import Sequence

import numpy as np
import pytest

from fras_common.codec import decode, encode
from fras_common.messages import Verdict
from fras_common.scenario import Scenario, nodes_in_discs, resolve
from fras_sa.adapter import verdict_of
from fras_sa.awareness import (
    ARMS,
    ActionView,
    ArmView,
    Awareness,
    AwarenessParameters,
    Judgement,
    Memory,
    RobotView,
    TissueView,
    Trend,
    UnusableState,
)
from fras_sim.fem import TissueParameters, TissueSimulator, ToolInput, box_mesh
from support.tissues import tissue as on_the_wire

DT_S = 0.02
LIMIT_N = 0.5


def robot(tick: int, name: str | None = "pull", arms: Sequence[str] = ARMS):
    action = None if name is None else ActionView(name, "psm1", "b(1,1)", "lift")
    return RobotView(tick, {arm: ArmView(np.array([0.0, 0.0, 0.3]), 1.0) for arm in arms}, action)


def tissue(model, tick, force_n, *, converged=True):
    return TissueView(tick, model.nodes_m, force_n, {}, converged=converged)


def judged(box, forces, name="pull", **parameters) -> list[Judgement]:
    """Judge a course of forces from tick 0; None stands for a tick that did not converge."""
    model = box()
    sa = Awareness(AwarenessParameters(**parameters), model)
    memory, judgements = Memory(), []
    for tick, force in enumerate(forces):
        state = tissue(model, tick, force or 0.0, converged=force is not None)
        judgements.append(sa.judge(state, robot(tick, name), memory))
        memory = judgements[-1].memory
    return judgements


def growing(growth_s, start_n=0.12, ticks=200):
    return [start_n * math.exp(growth_s * DT_S * tick) for tick in range(ticks)]


def crossing(forces: Sequence[float], limit_n=LIMIT_N) -> int:
    return next(tick for tick, force in enumerate(forces) if force > limit_n)


@pytest.mark.parametrize("slope_n_s", [0.3, -0.3, 0.0])
def test_the_rate_is_that_of_a_steady_course_with_its_sign(box, slope_n_s):
    rates = [j.rate_n_s for j in judged(box, [0.4 + slope_n_s * DT_S * k for k in range(20)])]
    assert rates[0] == 0.0
    assert rates[-1] == pytest.approx(slope_n_s, abs=1e-6)


def test_half_of_a_change_is_told_a_tick_later(box):
    assert [j.rate_n_s for j in judged(box, [0.1, 0.2, 0.3])] == pytest.approx([0.0, 2.5, 3.75])


@pytest.mark.parametrize("growth_s", [1.0, 3.0, 8.0])
def test_growth_in_proportion_is_predicted_all_along(box, growth_s):
    forces = growing(growth_s)
    actual = crossing(forces)
    predicted = [j.crossing_tick for j in judged(box, forces)]
    in_sight = range(max(10, actual - 23), actual)
    assert all(abs(predicted[tick] - actual) <= 2 for tick in in_sight)
    assert predicted[actual:] == [-1] * len(predicted[actual:])


@pytest.mark.parametrize(
    ("name", "limit_n"), [("pull", 0.5), ("move", 1.0), ("grasp", 1.0), (None, 1.0)]
)
def test_the_limit_is_that_of_the_action(box, name, limit_n):
    forces = growing(5.0)
    actual = crossing(forces, limit_n)
    assert judged(box, forces, name)[actual - 5].crossing_tick == pytest.approx(actual, abs=1)


def test_nothing_is_predicted_without_a_limit_far_off_or_when_the_force_falls(box):
    rising = growing(5.0)
    assert {j.crossing_tick for j in judged(box, rising, no_limit=True)} == {-1}
    assert {j.crossing_tick for j in judged(box, rising[::-1])[:-1]} == {-1}
    early = judged(box, growing(5.0, start_n=0.001))
    assert {j.crossing_tick for j in early if j.force_n < 0.2 * LIMIT_N} == {-1}
    slow = judged(box, growing(0.3))
    assert all(j.crossing_tick <= tick + 25 for tick, j in enumerate(slow))
    assert slow[10].crossing_tick == -1


@pytest.mark.parametrize("huge_n", [1e308, 1.7e308])
def test_forces_near_the_largest_number_leave_a_rate_that_is_one(box, huge_n):
    rates = [j.rate_n_s for j in judged(box, [0.0, huge_n, 0.0, 0.1, 0.2], "reach")]
    assert all(map(math.isfinite, rates))


def test_an_invalid_tick_leaves_the_rate_and_no_difference_is_taken_across_it(box):
    forces: list[float | None] = [*growing(3.0)[:12]]
    broken = [*forces[:8], None, *forces[9:]]
    straight, interrupted = judged(box, forces), judged(box, broken)
    before, invalid, after = interrupted[7:10]
    assert (invalid.level, invalid.crossing_tick) == ("invalid", -1)
    assert invalid.rate_n_s == before.rate_n_s == after.rate_n_s > 0.0
    assert after.crossing_tick == pytest.approx(straight[9].crossing_tick, abs=3)
    assert interrupted[10].rate_n_s == pytest.approx(straight[10].rate_n_s, rel=0.1)


def test_the_last_verdict_restores_the_trend_to_the_last_bit(box):
    model = box()
    parameters = AwarenessParameters()
    sa = Awareness(parameters, model)
    rng = np.random.default_rng(4)
    straight = restarted = Memory()
    for tick in range(60):
        state = tissue(model, tick, float(rng.uniform(0, 0.6)), converged=tick % 7 != 3)
        arms = robot(tick)
        one, two = sa.judge(state, arms, straight), sa.judge(state, arms, restarted)
        assert two == one
        sent = encode(verdict_of(one, parameters, on_the_wire(tick)))
        told = decode(Verdict, sent, "sa/verdict")
        trend = Trend.restored(told.tick, told.level, told.max_force_n, told.force_rate_n_s)
        straight = one.memory
        restarted = Memory.restored(told.max_height, arms.action, trend)
        assert restarted == straight


@pytest.mark.parametrize(("last", "tick"), [(-1, 1), (4, 4), (4, 3), (4, 6), (4, 0)])
def test_a_tick_that_does_not_follow_is_stale(box, last, tick):
    model = box()
    memory = Memory(trend=Trend(last, 0.1, 0.0))
    verdict = Awareness(AwarenessParameters(), model).judge(
        tissue(model, tick, 0.1), robot(tick), memory
    )
    assert (verdict.level, verdict.reason, verdict.crossing_tick) == ("invalid", "stale", -1)
    assert verdict.memory.trend == Trend(tick, None, 0.0)


@pytest.mark.parametrize("limits", [{}, {"no_limit": True}])
@pytest.mark.parametrize(
    ("stale", "told"),
    [
        (robot(4), "robot of tick 4 with tissue of tick 5"),
        (robot(6), "robot of tick 6 with tissue of tick 5"),
        (robot(5, arms=["psm1"]), "no state of psm2"),
        (robot(5, None, arms=[]), "no state of psm1 and psm2"),
    ],
)
def test_states_of_two_ticks_or_without_an_arm_are_stale_and_tell_no_fluent(
    box, stale, told, limits
):
    model = box()
    sa = Awareness(AwarenessParameters(**limits), model)
    memory = Memory(trend=Trend(4, 0.1, 0.0))
    verdict = sa.judge(tissue(model, 5, 0.1), stale, memory)
    assert (verdict.level, verdict.ok, verdict.reason) == ("invalid", False, "stale")
    with pytest.raises(UnusableState, match=told):
        sa.context(tissue(model, 5, 0.1), stale, memory)
    with pytest.raises(UnusableState, match=told):
        sa.target(tissue(model, 5, 0.1), stale, action="reach", arm="psm1", block="b(1,1)")


def pulled(seed: int) -> list[float]:
    """Largest nodal force in each tick of a 50 mm pull at 20 mm/s, by the real simulator.

    Grasped is what the planner's criterion prefers: far from attachments, near the ROI.
    """
    scenario = resolve(Scenario(seed=seed))
    assert scenario.scene is not None
    mesh = box_mesh(node_counts=scenario.tissue.node_counts)
    attached = nodes_in_discs(mesh.nodes_m, mesh.bottom_nodes, scenario.scene.discs)
    x, y = np.meshgrid((np.arange(7) + 0.5) * 0.1 / 7, (np.arange(7) + 0.5) * 0.12 / 7)
    blocks = np.column_stack([x.ravel(), y.ravel(), np.full(49, 0.005)])
    gap_m = np.linalg.norm(blocks[:, None, :2] - mesh.nodes_m[attached, :2], axis=2).min(axis=1)
    way_m = np.linalg.norm(blocks[:, :2] - scenario.scene.roi_m[:2], axis=1)
    tip_m = blocks[np.argmax(2 * gap_m - way_m)]
    simulator = TissueSimulator(mesh, TissueParameters(dt_s=DT_S), attached)
    simulator.measure({"psm1": ToolInput(tip_m, 1.0)})
    forces = [simulator.step({"psm1": ToolInput(tip_m, -0.3)}).max_force_n]
    for tick in range(1, 126):
        at_m = tip_m + np.array([0.0, 0.0, 0.0004 * tick])
        forces.append(simulator.step({"psm1": ToolInput(at_m, -0.3)}).max_force_n)
    return forces


def test_crossings_of_real_pulls_are_predicted_and_far_better_than_by_a_straight_line(box):
    off: dict[int, list[int]] = {20: [], 10: [], 5: []}
    straight: dict[int, list[int]] = {20: [], 10: [], 5: []}
    for seed in (4, 5, 7, 8, 10, 16, 19, 20, 24):  # those of 1 to 24 that cross
        forces = pulled(seed)
        actual = crossing(forces)
        judgements = judged(box, forces[: actual + 1])
        for ticks in off:
            at = actual - ticks
            off[ticks].append(abs(judgements[at].crossing_tick - actual))
            line = (LIMIT_N - forces[at]) / (forces[at] - forces[at - 1])
            straight[ticks].append(abs(at + math.floor(line) + 1 - actual))
    assert len(off[20]) >= 9
    assert max(off[20]) <= 3
    assert max(off[10]) <= 4
    assert max(off[5]) <= 2
    assert statistics.median(off[10]) <= 1
    assert 3 * statistics.mean(off[20]) < statistics.mean(straight[20])
