"""The fast Algorithms 1 and 2 agree with the slow ones of `support/slow_awareness.py`."""

import itertools
import statistics
import time
from typing import Any

import numpy as np
import pytest

from fras_sa.awareness import (
    ActionView,
    ArmView,
    Awareness,
    AwarenessParameters,
    Memory,
    RobotView,
    TissueModel,
    TissueView,
)
from support import campaign
from support.slow_awareness import (
    LX,
    LY,
    block_now,
    check_failure,
    compute_fluents,
    compute_p_close,
    compute_target,
    max_heights,
    visible,
)


def random_scene(rng, box):
    n = int(rng.integers(3, 11))
    counts = [(6, 7, 2), (11, 13, 2), (7, 9, 3)][rng.integers(3)]
    raster = [
        (x * 0.0025, y * 0.0025, 0.0) for x in range(41) for y in range(49) if rng.random() < 0.01
    ]
    roi = (rng.uniform(0.015, 0.085), rng.uniform(0.015, 0.105), -rng.uniform(0, 0.004))
    soft = float(rng.uniform(0.2, 0.8))
    limits: dict[str, Any] = {
        "force_limit_n": soft,
        "hard_limit_n": soft * float(rng.uniform(1.0, 2.0)),
        "force_metric": ("nodal_max", "tool")[rng.integers(2)],
        "no_limit": bool(rng.random() < 0.1),
    }
    return n, box(counts, roi=roi, fixed=raster, flip=bool(rng.random() < 0.5)), limits


def random_actions(rng, ticks):
    """Actions as `robot/state` shows them: some end, some are cut off, some ticks have none."""
    actions = []
    while len(actions) < ticks:
        if rng.random() < 0.2:
            actions.append(None)
            continue
        name = ("reach", "grasp", "release", "pull", "move")[rng.integers(5)]
        arm = ("psm1", "psm2")[rng.integers(2)]
        phases = ["go"] * int(rng.integers(0, 4))
        if rng.random() < 0.8:
            phases.append(("done", "interrupted")[rng.integers(2)])
        actions += [ActionView(name, arm, "b(1,1)", phase) for phase in phases]
    return actions[:ticks]


def random_state(rng, model, n):
    at = rng.uniform((0, 0), (LX, LY))
    width, height = rng.uniform(0.015, 0.08), rng.uniform(0, 0.05)
    nodes = model.nodes_m + rng.normal(0, 2e-4, model.nodes_m.shape)
    distance = np.linalg.norm(model.nodes_m[:, :2] - at, axis=1)
    nodes[:, 2] += height * np.exp(-((distance / width) ** 2))
    arms = {}
    for name in ("psm1", "psm2"):
        i, j = rng.integers(1, n + 1, 2)
        near = block_now(
            model.nodes_m.tolist(),
            nodes.tolist(),
            model.triangles.tolist(),
            (i - 0.5) * LX / n,
            (j - 0.5) * LY / n,
        )
        step = rng.normal(size=3)
        step *= rng.uniform(0, 0.01) / np.linalg.norm(step)
        arms[name] = (np.array(near) + step, float(rng.uniform(-0.3, 1.0)))
    return nodes, arms


def random_tissue(rng, tick, nodes):
    tools = {arm: rng.normal(0, 0.4, 3) for arm in ("psm1", "psm2") if rng.random() < 0.7}
    force = float(rng.uniform(0, 1.4))
    return TissueView(tick, nodes, force, tools, converged=bool(rng.random() < 0.9))


@pytest.mark.parametrize("seed", range(campaign.length(20, 7)))
def test_fast_and_slow_agree_on_random_states(box, seed):
    rng = np.random.default_rng(seed)
    n, model, limits = random_scene(rng, box)
    sa = Awareness(AwarenessParameters(blocks=n, **limits), model)
    rest, triangles = model.nodes_m.tolist(), model.triangles.tolist()
    roi = model.roi_m.tolist()
    p_close = compute_p_close(rest, triangles, roi)
    scene = (rest, triangles, model.fixed_points_m.tolist(), roi, p_close)
    kinds, history, memory = set(), [], Memory()
    for tick, action in enumerate(random_actions(rng, 50)):
        nodes, arms = random_state(rng, model, n)
        tissue = random_tissue(rng, tick, nodes)
        robot = RobotView(tick, {k: ArmView(*v) for k, v in arms.items()}, action)
        verdict = sa.judge(tissue, robot, memory)
        level = check_failure(limits, tissue, action)
        seen = visible(p_close, nodes.tolist(), roi)
        assert verdict.level == level
        assert verdict.visibility == pytest.approx(seen, abs=1e-9)
        history.append((action, level, seen > 0.7, arms[action.arm][1] if action else 0.0))
        max_height = max_heights(history)
        assert set(verdict.max_height) == max_height
        memory = verdict.memory

        context = sa.context(tissue, robot, memory)
        expected = compute_fluents(scene, nodes.tolist(), arms, max_height, n)
        assert set(context.fluents) == expected
        assert len(context.fluents) == len(expected)
        assert set(context.evidence) == expected | {"visible_roi", "force"}
        kinds |= {fluent.split("(")[0] for fluent in expected} | {level}

        i, j = (int(k) for k in rng.integers(1, n + 1, 2))
        centre = (i - 0.5) * LX / n, (j - 0.5) * LY / n
        now = block_now(rest, nodes.tolist(), triangles, *centre)
        for name, arm in itertools.product(("reach", "grasp", "release", "pull", "move"), arms):
            target = sa.target(tissue, robot, action=name, arm=arm, block=f"b({i},{j})")
            wanted = compute_target(name, now, centre, arms[arm][0])
            assert (target is None) == (wanted is None)
            assert target is None or target == pytest.approx(wanted, abs=1e-9)
    assert kinds >= {"at", "in_hand", "closed_gripper", "above_roi", "reachable", "ok", "invalid"}
    assert limits["no_limit"] or kinds >= {"max_height", "hard"}


def test_a_verdict_takes_a_millisecond_at_most_and_a_context_three(box, record_property):
    model: TissueModel = box(
        (21, 25, 3),
        fixed=[(x, y, 0.0) for x in np.arange(0, 0.05, 0.0025) for y in np.arange(0, 0.12, 0.0025)],
    )
    sa = Awareness(AwarenessParameters(blocks=10), model)
    nodes = (model.nodes_m + np.array([0, 0, 0.005])).astype(np.float32)
    tissue = TissueView(0, nodes, 0.4, {"psm1": np.zeros(3), "psm2": np.zeros(3)}, converged=True)
    robot = RobotView(
        0,
        {"psm1": ArmView(nodes[300].astype(float), -0.3), "psm2": ArmView(np.zeros(3), 1.0)},
        ActionView("pull", "psm1", "b(1,1)", "lift"),
    )
    for name, call, limit_s in (
        ("judge", lambda: sa.judge(tissue, robot, Memory()), 1e-3),
        ("context", lambda: sa.context(tissue, robot, Memory()), 3e-3),
    ):
        took: list[float] = []
        for _ in range(200):
            start = time.perf_counter()
            call()
            took.append(time.perf_counter() - start)
        record_property(f"{name}_p50_s", statistics.median(took))
        # The median, so that the neighbours of a shared machine don't decide.
        assert statistics.median(took) <= limit_s, name
