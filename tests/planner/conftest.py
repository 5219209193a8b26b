"""Scenes for the planner's tests: the paper's tissue with discs of attachment points."""

from collections.abc import Callable

import numpy as np
import pytest

from fras_planner.knowledge import load_knowledge
from fras_planner.planning import Knowledge, Planner, PlanningScene

LENGTH_M = (0.1, 0.12)

SceneMaker = Callable[..., PlanningScene]


@pytest.fixture(scope="session")
def knowledge() -> Knowledge:
    return load_knowledge()


@pytest.fixture(scope="session")
def make_scene() -> SceneMaker:
    """Random scene of N x N blocks from a seed; `fixed` overrides the attached blocks."""

    def make(n: int, seed: int = 0, fixed: list[str] | None = None) -> PlanningScene:
        rng = np.random.default_rng([n, seed])
        names = [f"b({i},{j})" for i in range(1, n + 1) for j in range(1, n + 1)]
        step = np.array(LENGTH_M) / n
        cells = np.array([(i, j) for i in range(n) for j in range(n)])
        centres = (cells + 0.5) * step
        roi = rng.uniform([0.015, 0.015], [0.085, 0.105])
        if fixed is None:
            discs = rng.uniform([0, 0], LENGTH_M, size=(int(rng.integers(0, 4)), 2))
            apart = np.linalg.norm(centres[:, None] - discs[None], axis=2)
            fixed = [name for name, d in zip(names, apart, strict=True) if (d < 0.025).any()]
        over = cells.tolist().index((roi // step).astype(int).tolist())
        statics = [f"fixed({name})" for name in fixed]
        statics += [f"above_roi({names[over]})"]
        for name, (_, y) in zip(names, centres, strict=True):
            statics.append(f"reachable(psm{1 if y < 0.06 - 1e-9 else 2},{name})")
        blocks = np.column_stack([centres, np.full(len(names), 0.005)])
        return PlanningScene.make(names, blocks, [*roi, 0.0], statics)

    return make


@pytest.fixture(scope="session")
def four_blocks() -> PlanningScene:
    """Four blocks 40 mm apart, the ROI 10 mm beside (1,2), an attachment under (1,1)."""
    names = ["b(1,1)", "b(1,2)", "b(2,1)", "b(2,2)"]
    blocks = [(0.0, 0.0, 0.0), (0.0, 0.04, 0.0), (0.04, 0.0, 0.0), (0.04, 0.04, 0.0)]
    statics = ["fixed(b(1,1))", "above_roi(b(1,2))"]
    statics += ["reachable(psm1,b(1,1))", "reachable(psm1,b(2,1))"]
    statics += ["reachable(psm2,b(1,2))", "reachable(psm2,b(2,2))"]
    return PlanningScene.make(names, blocks, (0.01, 0.04, -0.001), statics)


@pytest.fixture(scope="module")
def scene(four_blocks: PlanningScene) -> PlanningScene:
    """What a module plans in; one that needs another scene has its own fixture of this name."""
    return four_blocks


@pytest.fixture(scope="module")
def planner(knowledge: Knowledge, scene: PlanningScene) -> Planner:
    return Planner(knowledge, scene, "weighted")
