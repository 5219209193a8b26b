"""max_height: what sets it, what clears it, and that it survives a restart."""

import numpy as np
import pytest

from fras_sa.awareness import (
    ActionView,
    ArmView,
    AwarenessParameters,
    Level,
    Memory,
    RobotView,
    Trend,
)
from fras_sa.awareness.memory import remember

PARAMETERS = AwarenessParameters()
PSM1 = frozenset({"psm1"})
STILL = Trend()


def tick(
    memory: Memory,
    name: str,
    phase: str,
    *,
    level: Level = "ok",
    visible: bool = False,
    arm: str = "psm1",
    jaw: float = -0.3,
    trend: Trend = STILL,
) -> Memory:
    action = ActionView(name, arm, "b(1,1)", phase)
    robot = RobotView(0, {a: ArmView(np.zeros(3), jaw) for a in ("psm1", "psm2")}, action)
    return remember(memory, PARAMETERS, robot, level, visible=visible, trend=trend)


def test_starts_empty_and_stays_so_without_an_action():
    robot = RobotView(0, {}, None)
    for before in (Memory(), Memory(PSM1)):
        assert remember(before, PARAMETERS, robot, "ok", visible=False, trend=STILL) == before


@pytest.mark.parametrize("phase", ["lift", "settle", "stop", "retreat"])
def test_a_soft_crossing_sets_it_for_the_arm_that_pulls(phase):
    assert tick(Memory(), "pull", phase, level="soft", arm="psm2").max_height == {"psm2"}


@pytest.mark.parametrize(
    ("name", "jaw", "expected"),
    [
        ("pull", -0.3, {"psm1"}),
        ("move", -0.3, {"psm1"}),
        ("grasp", 0.3, {"psm1"}),
        ("grasp", 0.5, set()),
        ("reach", 1.0, set()),
        ("release", -0.3, set()),
    ],
)
def test_a_hard_crossing_sets_it_where_the_arm_holds(name, jaw, expected):
    assert tick(Memory(), name, "stop", level="hard", jaw=jaw).max_height == expected


@pytest.mark.parametrize(
    ("phase", "visible", "expected"),
    [
        ("done", False, {"psm1"}),
        ("done", True, set()),
        ("lift", False, set()),
        ("settle", False, set()),
        ("interrupted", False, set()),
    ],
)
def test_the_height_reached_unexposed_sets_it(phase, visible, expected):
    assert tick(Memory(), "pull", phase, visible=visible).max_height == expected


@pytest.mark.parametrize("name", ["reach", "grasp", "move", "release"])
def test_only_a_pull_reaches_a_height(name):
    assert tick(Memory(), name, "done").max_height == set()


@pytest.mark.parametrize("phase", ["carry", "settle", "done", "stop"])
@pytest.mark.parametrize("name", ["move", "release"])
def test_the_first_tick_of_a_move_or_release_clears_it(name, phase):
    assert tick(Memory(PSM1), name, phase).max_height == set()
    assert tick(Memory(PSM1), name, phase, arm="psm2").max_height == PSM1


@pytest.mark.parametrize("name", ["reach", "grasp", "pull"])
def test_other_actions_leave_it(name):
    assert tick(Memory(PSM1), name, "lift").max_height == PSM1


def test_a_hard_crossing_in_a_move_outlasts_that_move_and_falls_with_the_next():
    memory = tick(Memory(PSM1), "move", "carry")
    memory = tick(memory, "move", "carry", level="hard")
    for phase in ("stop", "retreat", "settle", "interrupted"):
        memory = tick(memory, "move", phase)
    assert memory == Memory(PSM1, None)
    assert tick(memory, "move", "carry").max_height == set()
    assert tick(memory, "release", "open", level="hard").max_height == set()


def test_an_invalid_tick_sets_nothing():
    assert tick(Memory(), "pull", "done", level="invalid").max_height == set()
    assert tick(Memory(PSM1), "pull", "lift", level="invalid").max_height == PSM1


def test_a_restart_at_any_tick_changes_nothing():
    ticks: list[tuple[str, str, Level, str]] = [
        ("pull", "lift", "ok", "psm1"),
        ("pull", "lift", "soft", "psm1"),
        ("pull", "retreat", "soft", "psm1"),
        ("pull", "interrupted", "ok", "psm1"),
        ("move", "carry", "ok", "psm1"),
        ("move", "carry", "hard", "psm1"),
        ("move", "retreat", "ok", "psm1"),
        ("move", "interrupted", "ok", "psm1"),
        ("release", "open", "hard", "psm1"),
        ("release", "settle", "ok", "psm1"),
        ("release", "done", "ok", "psm1"),
        ("pull", "lift", "ok", "psm2"),
        ("pull", "done", "ok", "psm2"),
    ]
    straight = restarted = Memory()
    for name, phase, level, arm in ticks:
        straight = tick(straight, name, phase, level=level, arm=arm)
        restarted = tick(restarted, name, phase, level=level, arm=arm)
        last = ActionView(name, arm, "b(1,1)", phase)
        restarted = Memory.restored(sorted(restarted.max_height), last, STILL)
        assert restarted == straight
    assert straight.max_height == {"psm2"}
