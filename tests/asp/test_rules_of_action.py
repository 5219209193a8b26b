"""Pre-conditions (actions.lp) and executability constraints (constraints.lp), one test a rule."""

from collections.abc import Callable

import pytest

Ask = Callable[..., frozenset[str] | None]
HOLDS = "in_hand(psm1,b(2,1)). at(psm1,b(2,1)). closed_gripper(psm1). "
HOLDS_2 = "in_hand(psm2,b(1,2)). at(psm2,b(1,2)). closed_gripper(psm2). "
AT_LIMIT = "max_height(psm1). "


# --- pre-conditions ---------------------------------------------------------------------------


def test_reach_goes_to_the_target_and_needs_one(ask: Ask) -> None:
    assert ask("", ["reach psm1"], target="psm1,b(2,1)") is not None
    assert ask("", ["reach psm1"]) is None
    assert ask("", ["reach psm2"], target="psm1,b(2,1)") is None


def test_only_what_the_arm_reaches_becomes_a_target(ask: Ask) -> None:
    assert ask("", ["reach psm2"], target="psm2,b(1,2)") is not None
    assert ask("", ["reach psm1"], target="psm1,b(1,2)") is None


def test_grasp_needs_the_tool_at_the_target(ask: Ask) -> None:
    assert ask("at(psm1,b(2,1)).", ["grasp psm1"], target="psm1,b(2,1)") is not None
    assert ask("", ["grasp psm1"], target="psm1,b(2,1)") is None
    assert ask("at(psm2,b(1,2)).", ["grasp psm2"], target="psm1,b(2,1)") is None


@pytest.mark.parametrize("action", ["pull", "move"])
def test_pull_and_move_need_tissue_in_hand(ask: Ask, action: str) -> None:
    limit = AT_LIMIT if action == "move" else ""
    assert ask(HOLDS + limit, [f"{action} psm1"]) is not None
    assert ask("closed_gripper(psm1). " + limit, [f"{action} psm1"]) is None
    assert ask(HOLDS + limit, [f"{action} psm2"]) is None


def test_a_fresh_grasp_is_not_moved_sideways(ask: Ask) -> None:
    grasp = ["reach psm1", "grasp psm1"]
    aim = {"target": "psm1,b(2,1)", "lifted": ["respect_limit"]}
    assert ask(AT_LIMIT, [*grasp, "pull psm1"], **aim) is not None
    assert ask(AT_LIMIT, [*grasp, "move psm1"], **aim) is None


def test_move_needs_to_know_the_block_above_the_roi(ask: Ask) -> None:
    scene = "block(b(2,1)). reachable(psm1,b(2,1)). "
    assert ask(HOLDS + AT_LIMIT, ["move psm1"], scene=scene) is None
    assert ask(HOLDS + AT_LIMIT, ["move psm1"], scene=scene + "above_roi(b(2,1)).") is not None


def test_release_needs_a_closed_gripper_or_a_limit_to_forget(ask: Ask) -> None:
    assert ask("closed_gripper(psm1).", ["release psm1"]) is not None
    assert ask("max_height(psm1).", ["release psm1"]) is not None
    assert ask("", ["release psm1"]) is None


def test_one_action_a_step(ask: Ask) -> None:
    atoms = ask("closed_gripper(psm1). closed_gripper(psm2).", ["release psm1", "release psm2"])
    assert atoms is not None
    assert len([atom for atom in atoms if atom.startswith("occurs(") and atom.endswith(",1)")]) == 1


def test_two_releases_in_a_row_follow_the_order_of_the_arms(ask: Ask) -> None:
    state = "closed_gripper(psm1). closed_gripper(psm2)."
    assert ask(state, ["release psm1", "release psm2"]) is not None
    assert ask(state, ["release psm2", "release psm1"]) is None


# --- named constraints ------------------------------------------------------------------------


def test_tissue_over_an_attachment_is_no_target(ask: Ask) -> None:
    forced = {"course": ["reach psm1"], "target": "psm1,b(1,1)"}
    assert ask("", **forced) is None
    lifted = ask("", **forced, lifted=["keep_off_attachments"])
    assert lifted is not None
    assert "forbidden(reach(psm1,b(1,1)),keep_off_attachments)" in lifted
    assert "candidate(b(1,1))" not in lifted
    assert "candidate(b(2,1))" in lifted


def test_told_to_ignore_attachments_they_do_not_count(ask: Ask) -> None:
    atoms = ask("ignore_ap.", ["reach psm1"], target="psm1,b(1,1)")
    assert atoms is not None
    assert "candidate(b(1,1))" in atoms


def test_a_tried_block_is_no_target(ask: Ask) -> None:
    forced = {"course": ["reach psm1"], "target": "psm1,b(2,1)"}
    assert ask("", **forced) is not None
    assert ask("tried(b(2,1)).", **forced) is None
    lifted = ask("tried(b(2,1)).", **forced, lifted=["try_once"])
    assert lifted is not None
    assert "forbidden(reach(psm1,b(2,1)),try_once)" in lifted
    assert "candidate(b(2,1))" not in lifted


@pytest.mark.parametrize(("action", "limit"), [("pull", ""), ("move", AT_LIMIT)])
def test_tried_tissue_in_hand_is_neither_pulled_nor_moved(
    ask: Ask, action: str, limit: str
) -> None:
    state = HOLDS + limit + "tried(b(2,1))."
    assert ask(state, [f"{action} psm1"]) is None
    lifted = ask(state, [f"{action} psm1"], lifted=["try_once"])
    assert lifted is not None
    assert f"forbidden({action},psm1,try_once,1)" in lifted


@pytest.mark.parametrize(("action", "limit"), [("pull", ""), ("move", AT_LIMIT)])
def test_attached_tissue_in_hand_is_neither_pulled_nor_moved(
    ask: Ask, action: str, limit: str
) -> None:
    state = "in_hand(psm1,b(1,1)). closed_gripper(psm1). " + limit
    assert ask(state, [f"{action} psm1"]) is None
    assert ask(state + "ignore_ap.", [f"{action} psm1"]) is not None
    lifted = ask(state, [f"{action} psm1"], lifted=["keep_off_attachments"])
    assert lifted is not None
    assert f"forbidden({action},psm1,keep_off_attachments,1)" in lifted


def test_a_gripper_that_spans_a_clean_block_may_pull(ask: Ask) -> None:
    assert ask(HOLDS + "in_hand(psm1,b(1,1)).", ["pull psm1"]) is not None
    assert ask(HOLDS + "in_hand(psm1,b(1,1)). tried(b(2,1)).", ["pull psm1"]) is None


def test_no_higher_at_the_limit(ask: Ask) -> None:
    assert ask(HOLDS + AT_LIMIT, ["pull psm1"]) is None
    lifted = ask(HOLDS + AT_LIMIT, ["pull psm1"], lifted=["respect_limit"])
    assert lifted is not None
    assert "forbidden(pull,psm1,respect_limit,1)" in lifted


def test_sideways_only_at_the_limit(ask: Ask) -> None:
    assert ask(HOLDS + AT_LIMIT, ["move psm1"]) is not None
    assert ask(HOLDS, ["move psm1"]) is None
    lifted = ask(HOLDS, ["move psm1"], lifted=["pull_before_moving"])
    assert lifted is not None
    assert "forbidden(move,psm1,pull_before_moving,1)" in lifted


@pytest.mark.parametrize("action", ["reach", "grasp"])
def test_reach_and_grasp_with_an_open_gripper(ask: Ask, action: str) -> None:
    at = "at(psm1,b(2,1)). "
    forced = {"course": [f"{action} psm1"], "target": "psm1,b(2,1)"}
    assert ask(at, **forced) is not None
    assert ask(at + "closed_gripper(psm1).", **forced) is None
    lifted = ask(at + "closed_gripper(psm1).", **forced, lifted=["open_gripper_first"])
    assert lifted is not None
    assert f"forbidden({action},psm1,open_gripper_first,1)" in lifted


@pytest.mark.parametrize("action", ["reach", "grasp"])
def test_no_second_grasp_while_any_arm_holds_tissue(ask: Ask, action: str) -> None:
    state = HOLDS_2 + "at(psm1,b(2,1)). "
    forced = {"course": [f"{action} psm1"], "target": "psm1,b(2,1)"}
    assert ask(state, **forced) is None
    lifted = ask(state, **forced, lifted=["one_grasp_at_a_time"])
    assert lifted is not None
    assert f"forbidden({action},psm1,one_grasp_at_a_time,1)" in lifted


def test_an_open_gripper_holds_nothing(ask: Ask) -> None:
    contradiction = "contradiction(psm1,open_gripper_holds)"
    wrong, right = ask("in_hand(psm1,b(2,1))."), ask(HOLDS)
    assert wrong is not None
    assert contradiction in wrong
    assert right is not None
    assert contradiction not in right


# --- goal -------------------------------------------------------------------------------------


def test_the_roi_must_be_seen_at_the_end(ask: Ask) -> None:
    assert ask(HOLDS, ["pull psm1"], goal="visible") is not None
    assert ask("visible_roi.", goal="visible") is not None
    assert ask("", goal="visible") is None
    assert ask("", goal="visible", lifted=["see_roi"]) is not None


def test_goal_clear_leaves_no_arm_at_its_limit(ask: Ask) -> None:
    state = HOLDS + AT_LIMIT + "visible_roi."
    assert ask(state, goal="visible") is not None
    assert ask(state, goal="clear") is None
    assert ask(state, goal="clear", lifted=["end_below_limit"]) is not None
    assert ask(state, ["move psm1"], goal="clear") is not None
