"""Each criterion against a search by brute force that shares no line with the planner."""

import math
import re
from collections.abc import Callable

import numpy as np
import pytest

from fras_planner.planning import Knowledge, Planner, PlanningScene
from fras_planner.planning.program import TELL_FILES
from support import campaign

SceneMaker = Callable[..., PlanningScene]
Block = tuple[int, int]
# Random scenes by their number of blocks along a side: a thousand for each criterion, if whole.
THOUSAND = {3: 600, 4: 200, 5: 60, 6: 40, 7: 30, 8: 25, 9: 25, 10: 20}
SCENES = {n: campaign.length(scenes, scenes // 5) for n, scenes in THOUSAND.items()}
CRITERIA = ("sum", "literal", "lex", "nearest", "weighted", "capped")


def whole_mm(a: tuple[float, ...], b: tuple[float, ...]) -> int:
    return math.floor(round(1000 * math.dist(a, b), 6) + 0.5)


def blocks_of(scene: PlanningScene, predicate: str) -> set[Block]:
    found: set[Block] = set()
    for atom in scene.statics:
        if atom.startswith(predicate + "("):
            i, j = re.findall(r"\d+", atom)[-2:]
            found.add((int(i), int(j)))
    return found


def brute_force(
    scene: PlanningScene, criterion: str, ignore_ap: bool, tried: set[Block]
) -> Block | None:
    rest = {
        (int(i), int(j)): point
        for (i, j), point in zip(
            (re.findall(r"\d+", name) for name in scene.names), scene.blocks_m, strict=True
        )
    }
    fixed = blocks_of(scene, "fixed")
    candidates = blocks_of(scene, "reachable") - tried
    if not ignore_ap:
        candidates -= fixed

    def worse(block: Block) -> tuple[int, ...]:
        roi = whole_mm(rest[block][:2], scene.roi_m[:2])
        away = [whole_mm(rest[block], rest[other]) for other in fixed]
        if ignore_ap:
            return (roi, *block)
        rank = {
            "sum": (-(sum(away) - roi),),
            "literal": (-(sum(set(away)) - roi),),
            "lex": (-sum(away), roi),
            "nearest": (-min(away, default=0), roi),
            "weighted": (-(2 * min(away, default=0) - roi),),
            "capped": (-(2 * min([*away, 25] if away else [0]) - roi),),
        }[criterion]
        return (*rank, *block)

    return min(candidates, key=worse) if candidates else None


@pytest.fixture(scope="module")
def wordless(knowledge: Knowledge) -> Knowledge:
    """Knowledge that tells no story: to tell thousands of plans would take a third of the time."""
    return Knowledge({**knowledge.files, **dict.fromkeys(TELL_FILES, "")}, "")


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("n", SCENES)
def test_the_target_is_the_optimum(
    wordless: Knowledge, make_scene: SceneMaker, criterion: str, n: int
) -> None:
    """All criteria judge the same scenes; what was tried and what is ignored is left to chance."""
    rng = np.random.default_rng([n, CRITERIA.index(criterion)])
    blocks = [(i, j) for i in range(1, n + 1) for j in range(1, n + 1)]
    for seed in range(SCENES[n]):
        scene = make_scene(n, seed)
        ignore_ap = bool(rng.random() < 0.25)
        share = rng.choice([0.0, 0.3])
        tried = {block for block in blocks if rng.random() < share}
        planner = Planner(wordless, scene, criterion)
        plan = planner.plan([], ignore_ap, [f"b({i},{j})" for i, j in sorted(tried)])
        best = brute_force(scene, criterion, ignore_ap, tried)
        wanted = "" if best is None else f"b({best[0]},{best[1]})"
        assert plan.target == wanted, (seed, tried, ignore_ap)


@pytest.mark.parametrize("criterion", CRITERIA)
def test_without_attachments_the_nearest_to_the_roi_or_the_first(
    knowledge: Knowledge, make_scene: SceneMaker, criterion: str
) -> None:
    scene = make_scene(5, 3, fixed=[])
    best = brute_force(scene, criterion, False, set())
    assert best is not None
    assert best == min(
        blocks_of(scene, "reachable"),
        key=lambda b: (whole_mm(scene.blocks_m[5 * (b[0] - 1) + b[1] - 1][:2], scene.roi_m[:2]), b),
    )
    assert Planner(knowledge, scene, criterion).plan([]).target == f"b({best[0]},{best[1]})"


def test_between_equals_the_smallest_indices(knowledge: Knowledge) -> None:
    names = [f"b({i},{j})" for i in (2, 10) for j in (2, 10)]
    corners = [(x, y, 0.0) for x in (0.0, 0.02) for y in (0.0, 0.02)]
    statics = [f"reachable(psm1,{name})" for name in names]
    scene = PlanningScene.make(names, corners, (0.01, 0.01, 0.0), statics)
    planner = Planner(knowledge, scene)
    assert planner.plan([]).target == "b(2,2)"
    assert planner.plan([], tried=["b(2,2)"]).target == "b(2,10)"
    assert planner.plan([], True, ["b(2,2)", "b(2,10)"]).target == "b(10,2)"


def test_of_two_arms_that_reach_the_target_the_first(knowledge: Knowledge) -> None:
    statics = ["reachable(psm2,b(1,1))", "reachable(psm1,b(1,1))"]
    scene = PlanningScene.make(["b(1,1)"], [(0, 0, 0)], (0, 0, 0), statics)
    planner = Planner(knowledge, scene)
    assert planner.plan([]).arm == "psm1"
    # The second is quicker if the first must open its gripper.
    assert planner.plan(["closed_gripper(psm1)"]).arm == "psm2"
