"""Causal laws and inertia (effects.lp), the first step (domain.lp), one test a rule."""

from collections.abc import Callable

import pytest

Ask = Callable[..., frozenset[str] | None]
HOLDS = "in_hand(psm1,b(2,1)). at(psm1,b(2,1)). closed_gripper(psm1). "
AIM = {"target": "psm1,b(2,1)"}


def at_step(atoms: frozenset[str] | None, step: int) -> set[str]:
    """Fluents of one step."""
    assert atoms is not None
    fluents = ("at", "in_hand", "closed_gripper", "max_height", "visible_roi")
    return {
        atom
        for atom in atoms
        if atom.endswith((f",{step})", f"({step})"))
        and atom.partition("(")[0] in fluents
        # Sensed atoms end in a block, `b(1,1)`, which looks like a step.
        and not atom.endswith("))")
    }


def test_the_first_step_is_what_was_sensed(ask: Ask) -> None:
    state = HOLDS + "max_height(psm2). visible_roi."
    assert at_step(ask(state), 1) == {
        "at(start,psm1,1)",
        "in_hand(start,psm1,1)",
        "closed_gripper(psm1,1)",
        "max_height(psm2,1)",
        "visible_roi(1)",
    }
    assert at_step(ask(""), 1) == set()


def test_a_tool_sensed_at_the_target_is_there(ask: Ask) -> None:
    there = ask("at(psm1,b(2,1)).", ["grasp psm1"], **AIM)
    assert {"at(start,psm1,1)", "at(target,psm1,1)"} <= at_step(there, 1)
    elsewhere = ask("at(psm1,b(1,1)).", ["reach psm1"], **AIM)
    assert at_step(elsewhere, 1) == {"at(start,psm1,1)"}


def test_reach_leaves_the_old_place_for_the_target(ask: Ask) -> None:
    atoms = ask("at(psm1,b(1,1)). at(psm2,b(2,2)).", ["reach psm1"], **AIM)
    assert at_step(atoms, 2) == {"at(target,psm1,2)", "at(start,psm2,2)"}


def test_grasp_closes_on_the_target(ask: Ask) -> None:
    atoms = ask("", ["reach psm1", "grasp psm1", "pull psm1"], **AIM)
    assert at_step(atoms, 3) == {
        "at(target,psm1,3)",
        "in_hand(target,psm1,3)",
        "closed_gripper(psm1,3)",
    }
    assert at_step(atoms, 4) - at_step(atoms, 3) >= {"visible_roi(4)"}
    assert {"in_hand(target,psm1,4)", "closed_gripper(psm1,4)"} <= at_step(atoms, 4)


def test_release_opens_and_drops_and_forgets_the_limit(ask: Ask) -> None:
    atoms = ask(HOLDS + "max_height(psm1). max_height(psm2).", ["release psm1"])
    assert at_step(atoms, 2) == {"max_height(psm2,2)"}


def test_an_empty_gripper_opens_where_it_is(ask: Ask) -> None:
    atoms = ask("at(psm1,b(2,1)). closed_gripper(psm1).", ["release psm1", "grasp psm1"], **AIM)
    assert {"at(start,psm1,2)", "at(target,psm1,2)"} <= at_step(atoms, 2)


def test_a_target_let_go_is_out_of_reach(ask: Ask) -> None:
    course = ["reach psm1", "grasp psm1", "release psm1"]
    assert ask("", [*course, "reach psm1"], **AIM) is not None
    assert ask("", [*course, "grasp psm1"], **AIM) is None


@pytest.mark.parametrize(("action", "limit"), [("pull", ""), ("move", "max_height(psm1).")])
def test_pull_and_move_are_expected_to_expose(ask: Ask, action: str, limit: str) -> None:
    assert "visible_roi(2)" in at_step(ask(HOLDS + limit, [f"{action} psm1"]), 2)


def test_move_forgets_the_limit_of_its_arm_only(ask: Ask) -> None:
    atoms = ask(HOLDS + "max_height(psm1). max_height(psm2).", ["move psm1"])
    assert "max_height(psm1,2)" not in at_step(atoms, 2)
    assert "max_height(psm2,2)" in at_step(atoms, 2)


def test_what_was_exposed_stays_so_until_tissue_falls_back(ask: Ask) -> None:
    assert "visible_roi(2)" in at_step(ask("visible_roi.", ["reach psm1"], **AIM), 2)
    empty = ask("visible_roi. closed_gripper(psm1).", ["release psm1"])
    assert "visible_roi(2)" in at_step(empty, 2)
    held = ask("visible_roi. " + HOLDS, ["release psm1"])
    assert "visible_roi(2)" not in at_step(held, 2)


def test_a_plan_has_no_pause(ask: Ask) -> None:
    assert ask(HOLDS, ["pull psm1", ""]) is not None
    assert ask(HOLDS, ["", "pull psm1"]) is None


def test_nothing_is_done_at_the_step_of_the_goal(ask: Ask) -> None:
    state = HOLDS + "visible_roi."
    assert ask(state, ["pull psm1"], goal="visible") is not None
    assert ask(state, ["pull psm1"], goal="visible", idle_at_end=False) is None
