"""A, B and C to their end, through one stack of real processes."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from fras_cli.trial import TrialView
from fras_common.messages import Context, Plan, RobotState, TissueState, Verdict
from fras_common.topics import TOPICS
from support.logs import assert_same_trial, messages

COARSE = "11,13,2"


def names(actions: Iterable[str]) -> list[str]:
    return [action.partition("(")[0] for action in actions]


def test_a_pull_exposes_below_the_limit(trials: Any) -> None:
    summary, log = trials.kept("a")
    assert (summary.outcome, summary.scenario_kind) == ("success", "A")
    assert names(summary.actions) == ["reach", "grasp", "pull"]
    assert summary.visibility is not None
    assert summary.visibility > 0.7
    assert summary.ticks_above_limit == 0
    assert summary.max_force_n is not None
    assert summary.max_force_n < summary.limit_n
    assert (summary.plans, summary.replans, summary.lost) == (2, 0, 0)
    assert summary.complete
    plans: list[Plan] = messages(log, "planner/plan")
    assert [len(plan.actions) for plan in plans] == [3, 0]
    assert plans[0].explanation
    contexts: list[Context] = messages(log, "sa/context")
    monitored = [[one.atom for one in context.monitored] for context in contexts]
    assert monitored == [[], *(action.expected for action in plans[0].actions)]
    assert all(one.holds and one.evidence for context in contexts for one in context.monitored)


def test_b_crossed_limit_leads_to_retreat_and_a_lateral_move(trials: Any) -> None:
    summary, log = trials.kept("b")
    assert summary.outcome in {"success", "failed"}
    assert summary.reason
    assert summary.scenario_kind == "B"
    assert names(summary.actions) == ["reach", "grasp", "pull", "move"]
    assert summary.ticks_above_limit > 0
    plans: list[Plan] = messages(log, "planner/plan")
    assert [plan.reason for plan in plans][:2] == ["initial", "force"]
    assert names(action.text for action in plans[1].actions) == ["move"]
    states: list[RobotState] = messages(log, "robot/state")
    phases = [state.action.phase for state in states if state.action]
    assert "stop" in phases
    assert "retreat" in phases
    verdicts: list[Verdict] = messages(log, "sa/verdict")
    crossing = next(verdict for verdict in verdicts if verdict.level == "soft")
    assert not crossing.visible
    told = [verdicts[crossing.tick - ticks].crossing_tick for ticks in (20, 10, 5)]
    assert told == pytest.approx([crossing.tick] * 3, abs=4)
    after_pull = next(
        state.tick for state in states if state.action and state.action.phase == "interrupted"
    )
    assert verdicts[after_pull].max_force_n <= 0.95 * summary.limit_n


def test_c_release_and_new_grasp_away_from_attachments(trials: Any) -> None:
    summary, log = trials.kept("c")
    assert (summary.outcome, summary.scenario_kind) == ("success", "C")
    assert names(summary.actions) == ["reach", "grasp", "pull", "release", "reach", "grasp", "pull"]
    plans: list[Plan] = messages(log, "planner/plan")
    assert plans[0].ignore_ap
    assert not plans[1].ignore_ap
    assert plans[1].tried == [plans[0].target]
    context: Context = messages(log, "sa/context")[0]
    assert f"fixed({plans[1].target})" not in context.fluents
    assert plans[1].target != plans[0].target


def test_no_motion_without_the_verdict_before_it(trials: Any) -> None:
    _, log = trials.kept("a")
    states: list[RobotState] = messages(log, "robot/state")
    tissues: list[TissueState] = messages(log, "sim/tissue_state")
    verdicts: list[Verdict] = messages(log, "sa/verdict")
    ticks = list(range(len(states)))
    assert [state.tick for state in states] == ticks
    assert [tissue.tick for tissue in tissues] == ticks
    assert [verdict.tick for verdict in verdicts] == ticks
    assert all(state.verdict_tick == state.tick - 1 for state in states)
    for before, state in zip(verdicts, states[1:], strict=False):
        assert before.stamp_ns <= state.stamp_ns


def test_log_holds_every_key_that_a_trial_uses(trials: Any) -> None:
    _, log = trials.kept("a")
    with log.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    recorded = {channel.topic for channel in summary.channels.values()}
    families = {topic.key.partition("{")[0] for topic in TOPICS}
    # Written to when something is wrong, somebody stops the arms, a client leads them, or a page
    # is open.
    unused = {"log/", "fault/", "motion/holds", "monitor/presence"}
    unused |= {topic.key for topic in TOPICS if topic.producer in ("client", "patient")}
    missing = {one for one in families - unused if not any(key.startswith(one) for key in recorded)}
    assert not missing


def test_all_blocks_fixed_is_no_plan_with_reasons(trials: Any, tmp_path: Path) -> None:
    scene = tmp_path / "all-fixed.toml"
    scene.write_text(
        "[scene]\nroi_m = [0.05, 0.06, 0.0]\n"
        "[[scene.discs]]\ncenter_m = [0.05, 0.06]\nradius_m = 0.1\n"
    )
    summary, log = trials.run(str(scene))
    assert summary.outcome == "no_plan"
    assert summary.actions == []
    plans: list[Plan] = messages(log, "planner/plan")
    assert plans[0].no_plan is not None
    assert plans[0].no_plan.sentences
    assert "\n".join(plans[0].no_plan.sentences) in summary.reason or summary.reason


def test_same_seed_is_the_same_trial_bit_for_bit(trials: Any) -> None:
    first = trials.kept("a")[1]
    trials.run("b", mesh=COARSE)  # what ran in between leaves no trace
    second = trials.run("a")[1]
    assert_same_trial(first, second)


def test_stop_and_resume_by_a_client_that_is_not_the_executive(trials: Any) -> None:
    from fras_common.messages import HoldRequest, ResumeRequest
    from fras_common.topics import HOLD, RESUME

    bus = trials.stack.link.bus
    held_at: list[int] = []
    seen: list[int] = []

    def press_stop_and_lift_it_at_rest(view: TrialView) -> None:
        if view.robot is None or view.robot.action is None:
            return
        if not held_at and view.robot.action.phase == "descend":
            state = bus.query(HOLD, HoldRequest(holder="cli", reason="test"), 5.0)
            assert state.holds == {"cli": "test"}
            held_at.append(state.tick)
        elif held_at and len(seen) < 2:
            # Two looks at the same tick: logical time stands still.
            seen[:] = [*(tick for tick in seen if tick == view.robot.tick), view.robot.tick]
            if len(seen) == 2:
                bus.query(RESUME, ResumeRequest(holder="cli", by="cli"), 5.0)

    summary, log = trials.run("a", press_stop_and_lift_it_at_rest, mesh=COARSE)
    states: list[RobotState] = messages(log, "robot/state")
    by_tick = {state.tick: state for state in states}  # a change of holds is told at once
    ended = next(s.tick for s in states if s.action and s.action.phase == "interrupted")
    assert ended - held_at[0] <= 4  # one under way, two to stop, one to say so
    for arm in ("psm1", "psm2"):
        at_rest, before = by_tick[ended].arms[arm], by_tick[ended - 1].arms[arm]
        assert at_rest.setpoint_joints == before.setpoint_joints
    assert summary.outcome == "success"
    assert summary.replans == 0  # a lifted stop is no failure of the plan
    plans: list[Plan] = messages(log, "planner/plan")
    assert "hold" in [plan.reason for plan in plans]
