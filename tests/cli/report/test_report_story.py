"""Plans and actions joined: which ran when, how they ended, and what to call it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest

from fras_cli.report import read_trial
from fras_cli.report.story import ActionStory, PlanStory, tell
from fras_cli.report.wording import changes, end_in_words, plan_title, reason_in_words


@pytest.fixture
def stories(log_path: Path) -> tuple[PlanStory, ...]:
    return tell(read_trial(log_path))


def test_kinds_and_times_of_the_plans(stories: tuple[PlanStory, ...]) -> None:
    assert [(story.kind, story.replan) for story in stories] == [
        ("plan", 0),
        ("re-plan", 1),
        ("check", 0),
    ]
    assert [story.at_s for story in stories] == pytest.approx([0.0, 5.0, 6.4])


def test_actions_run_one_after_the_other(stories: tuple[PlanStory, ...]) -> None:
    actions = [action for story in stories for action in story.actions]
    assert [action.end_s for action in actions] == pytest.approx([1.8, 2.4, 5.0, 6.4])
    assert [action.begin_s for action in actions] == pytest.approx([0.0, 1.8, 2.4, 5.0])
    assert [(action.end, action.reason) for action in actions] == [
        ("succeeded", ""),
        ("succeeded", ""),
        ("interrupted", "force_soft"),
        ("succeeded", ""),
    ]


def one_action_begun(log: Any, story: Any) -> None:
    """A plan of three, its first action begun: what a test adds decides how it ended."""
    log.put("planner/plan", story.plan(0, "initial", ("reach", "grasp", "pull")))
    status = msgspec.structs.replace(
        story.EMPTY_STATUS, phase="acting", plans=1, goal_id="g1", action="reach(psm1,b(4,4))"
    )
    log.put("planner/task_status", status)


def ends(log: Any) -> list[str]:
    log.file.close({})
    return [action.end for action in tell(read_trial(log.file.path))[0].actions]


def test_the_log_ends_in_an_action(new_log: Callable[..., Any], story: Any) -> None:
    log = new_log()
    one_action_begun(log, story)
    story.write_ticks(log, 0, 5)
    assert ends(log) == ["unfinished", "not begun", "not begun"]


def test_the_log_ends_before_the_action_s_first_tick(
    new_log: Callable[..., Any], story: Any
) -> None:
    log = new_log()
    one_action_begun(log, story)
    assert ends(log) == ["unfinished", "not begun", "not begun"]


def test_a_refused_action_keeps_the_reason(new_log: Callable[..., Any], story: Any) -> None:
    log = new_log()
    one_action_begun(log, story)
    log.put("planner/plan", story.plan(0, "refused: workspace", ("reach",)))
    log.file.close({})
    first, second = tell(read_trial(log.file.path))
    assert [action.end for action in first.actions] == ["refused", "not begun", "not begun"]
    assert first.actions[0].reason == "workspace"
    assert changes(first, second) == [
        "No longer carried out: grasp(psm1,b(4,4)), pull(psm1,b(4,4))."
    ]


def test_a_plan_after_a_hold_is_no_replan(new_log: Callable[..., Any], story: Any) -> None:
    log = new_log()
    log.put("planner/plan", story.plan(0, "initial", ("pull",)))
    log.put("planner/plan", story.plan(0, "hold", ("pull",)))
    log.put("planner/plan", story.plan(0, "force", ("move",)))
    log.file.close({})
    stories = tell(read_trial(log.file.path))
    assert [plan_title(story) for story in stories] == [
        "First plan",
        "Plan after a hold",
        "Re-plan 1",
    ]


def test_changes_name_target_arm_and_what_is_ruled_out(
    new_log: Callable[..., Any], story: Any
) -> None:
    before = msgspec.structs.replace(story.plan(0, "initial", ("pull",)), ignore_ap=True)
    after = msgspec.structs.replace(
        story.plan(0, "force", ("release",)), tried=["b(4,4)"], target="b(1,2)", arm="psm2"
    )
    log = new_log()
    log.put("planner/plan", before)
    log.put("planner/plan", after)
    log.file.close({})
    assert changes(*tell(read_trial(log.file.path))) == [
        "b(4,4) is no candidate any more.",
        "Attachment points, ignored before, count from now on.",
        "The block to hold changes from b(4,4) to b(1,2).",
        "The arm changes from psm1 to psm2.",
        "No longer carried out: pull(psm1,b(4,4)).",
    ]


@pytest.mark.parametrize(
    ("reason", "words"),
    [
        ("force_hard", "the hard force limit was crossed"),
        (
            "deviation: in_hand(psm1,b(1,1)) expected after grasp(psm1,b(1,1))",
            "after grasp(psm1,b(1,1)), in_hand(psm1,b(1,1)) does not hold, against expectation",
        ),
        (
            "deviation: at(psm1,b(1,1)) expected after reach(psm1,b(1,1)); distance 7.2 mm, "
            "needed below 5.0 mm",
            "after reach(psm1,b(1,1)), at(psm1,b(1,1)) does not hold, against expectation "
            "(distance 7.2 mm, needed below 5.0 mm)",
        ),
        (
            "deviation: -closed_gripper(psm1) expected after release(psm1)",
            "after release(psm1), closed_gripper(psm1) still holds, against expectation",
        ),
        ("hold:stale", "the states of tissue and robot did not belong together"),
        ("hold:sa", "held by sa and not let go"),
        ("gate:speed", "the safety gate speed stopped the arm"),
        ("something new", "something new"),
    ],
)
def test_reasons_in_words(reason: str, words: str) -> None:
    assert reason_in_words(reason) == words


def test_ends_in_words() -> None:
    action = ActionStory("pull(psm1)", "pull", "psm1", "", "g1", 0, 1, "interrupted", "force_soft")
    assert end_in_words(action) == "interrupted: the force limit was crossed"
