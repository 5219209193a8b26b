"""The plan as done, current and to come, whichever of status and plan arrives first."""

from typing import Any

from fras_common.messages import ActionResult, NoPlan
from fras_monitor.picture import apply
from fras_monitor.stop import StopRecord
from fras_monitor.timetable import latest_changes, timetable
from fras_monitor.view import course_of, view_of
from support import pictures as p

TEXTS = ("reach(psm1,b(3,4))", "grasp(psm1,b(3,4))", "pull(psm1,b(3,4))")


def states(*messages: object) -> list[list[str]]:
    return [[row.state for row in one.rows] for one in timetable(p.picture_of(*messages))]


def result(goal_id: str, outcome: Any, reason: str = "") -> ActionResult:
    return ActionResult(
        trial=p.TRIAL, goal_id=goal_id, name="", arm="", block="", outcome=outcome, reason=reason
    )


def test_done_current_and_to_come():
    status = p.task(action=TEXTS[1], plan="c1", done=[p.done(1, TEXTS[0])])
    assert states(p.plan("c1", *TEXTS), status) == [["done", "current", "next"]]
    assert states(status, p.plan("c1", *TEXTS)) == [["done", "current", "next"]]


def test_while_planning_nothing_is_under_way():
    status = p.task("planning", plan="c1", done=[p.done(1, TEXTS[0])])
    assert states(p.plan("c1", *TEXTS), status) == [["done", "next", "next"]]


def test_a_plan_that_waits_for_approval_is_all_to_come():
    status = p.task("awaiting_approval", plan="c1")
    assert states(p.plan("c1", *TEXTS), status) == [["next", "next", "next"]]


def test_a_new_plan_drops_what_was_left_of_the_one_before():
    status = p.task(action=TEXTS[0], plan="c2", done=[p.done(1, TEXTS[0])])
    plans = (p.plan("c1", *TEXTS), p.plan("c2", TEXTS[0], reason="force"))
    assert states(*plans, status) == [["done", "dropped", "dropped"], ["current"]]
    picture = p.picture_of(*plans, status)
    assert [one.reason for one in timetable(picture)] == [
        "The procedure begins.",
        "The force limit was crossed.",
    ]
    assert latest_changes(picture) == ["New plan because the force limit was crossed."]


def test_what_was_found_when_a_plan_was_made_is_told_as_it_was_then():
    fall_back = p.plan("c2", TEXTS[0], reason="exposure", goal="visible")
    end = p.plan("c3", reason="exposure", goal="visible")
    status = p.task("idle", plan="c3", outcome="success", done=[p.done(1, TEXTS[0])])
    picture = p.picture_of(p.plan("c1", *TEXTS), fall_back, end, status)
    assert [(one.title, one.reason) for one in timetable(picture)][1:] == [
        ("Plan 2", "The previous plan was carried out, and the target region was not yet exposed."),
        (
            "Nothing more to do",
            "The previous plan was carried out, and the target region was exposed.",
        ),
    ]
    assert latest_changes(picture) == [
        "No new plan is needed: the previous plan was carried out, "
        "and the target region was exposed."
    ]


def test_a_goal_that_asks_for_more_than_to_see_is_not_told_as_covered():
    plans = (p.plan("c1", *TEXTS), p.plan("c2", TEXTS[0], reason="exposure", goal="clear"))
    assert latest_changes(p.picture_of(*plans, p.task(plan="c2"))) == [
        "New plan because the previous plan was carried out, and more was to do."
    ]


def test_no_plan_is_not_told_as_a_goal_that_was_reached():
    none = p.plan("c2", reason="exposure", no_plan=NoPlan(core=[], sentences=["x"]))
    (_, section) = timetable(p.picture_of(p.plan("c1", *TEXTS), none, p.task(plan="c2")))
    assert section.title == "Plan 2"
    assert section.reason.endswith("not yet exposed.")


def test_an_action_that_did_not_succeed_says_why():
    status = p.task(action=TEXTS[0], plan="c2", done=[p.done(1, TEXTS[2])])
    picture = p.picture_of(status, result("g1", "interrupted", "force_soft"))
    (row,) = timetable(picture)[0].rows
    assert (row.state, row.note) == ("stopped", "stopped on the way: the force limit was crossed")


def test_a_page_opened_late_knows_what_was_done_from_the_status_alone():
    status = p.task(action=TEXTS[2], plan="c2", done=[p.done(1, TEXTS[0]), p.done(2, TEXTS[1])])
    assert states(status, p.plan("c2", TEXTS[2])) == [["done", "done"], ["current"]]


def test_nothing_of_another_trials_plan_shows():
    assert states(p.task(trial="t-2"), p.plan("c1", *TEXTS)) == []


def test_the_page_lays_out_a_trial_under_way():
    status = p.task(action=TEXTS[1], plan="c1", done=[p.done(1, TEXTS[0])])
    evidence = {"visible_roi": {"holds": 0.0, "threshold_fraction": 0.995}}
    picture = p.picture_of(
        p.model(),
        p.plan("c1", *TEXTS),
        status,
        p.context(
            "closed_gripper(psm1)", "fixed(b(1,1))", "reachable(psm1,b(1,1))", evidence=evidence
        ),
        p.verdict(50, level="soft", max_force_n=0.6, visibility=0.9949),
        p.robot(),
    )
    view = view_of(picture, StopRecord(), 0.1)
    assert view.live
    assert view.headline == "Right instrument: grasping the tissue at point 3-4"
    assert view.force is not None
    assert view.force.words == "0.60 N, above the limit of 0.50 N"
    assert view.visibility is not None
    assert view.visibility.words == "not exposed: 99.4% lifted clear, more than 99.5% is needed"
    assert [one.text for one in view.situation] == [
        "the jaws of the right instrument are closed",
        "1 of 4 points lie over an attachment",
    ]
    assert course_of(picture).at_s == [1.0]
    assert {one.life for one in view.services} == {"ready"}


def test_a_crossing_is_expected_of_what_moves_alone():
    heard = (p.task(action=TEXTS[2], plan="c1"), p.verdict(50, max_force_n=0.4, crossing_tick=60))
    moving = view_of(p.picture_of(*heard, p.robot()), StopRecord(), 0.1)
    assert moving.force is not None
    assert moving.force.words == "0.40 N, limit 0.50 N, expected to cross it soon"
    held = view_of(p.picture_of(*heard, p.robot(holds={"monitor": ""})), StopRecord(), 0.1)
    assert held.force is not None
    assert held.force.words == "0.40 N, limit 0.50 N"


def test_a_recording_is_told_as_complete_or_not():
    recorded = p.picture_of(p.recorder_status("closed"))
    assert view_of(recorded, StopRecord(), 0.1).log == "The recording is closed and complete."
    cut = view_of(p.picture_of(p.recorder_status("closed", lost=3)), StopRecord(), 0.1)
    assert cut.log == "The recording is closed. Parts of it are missing (3)."
    assert not cut.log_fine


def test_a_held_arm_is_the_headline_but_not_after_the_end():
    holds = {"cli": "bleeding"}
    held = p.picture_of(p.task(action=TEXTS[0], plan="c1"), p.robot(holds=holds))
    view = view_of(held, StopRecord(), 0.1)
    assert view.headline == "The arms are held"
    assert view.hold_words == ["Stopped at a terminal (bleeding)."]
    assert not view.held_here
    ended = apply(held, p.task("ended", outcome="failed", reason="replans"), 0.2)
    shown = view_of(ended, StopRecord(), 0.2)
    assert shown.headline == "Ended; the recording is being closed"
    assert shown.outcome == (
        "The target region could not be exposed. As many new plans were made as are allowed."
    )
