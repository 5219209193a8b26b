"""From a trial's log to its numbers."""

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from statistics import median
from typing import Final

import msgspec

from fras_cli.report import Trial, summarise
from fras_cli.report.trial import RobotTick
from fras_common.messages import Plan, Verdict
from fras_experiments.campaign.records import Lifted, Result, Timing, limits_of

EVERY_TICKS: Final = 5
_GRASP: Final = re.compile(r"grasp\(\w+,(.+)\)")
_LIFT: Final = "lift"


def measure(trial: Trial) -> Result:
    """Reduce a trial to its numbers."""
    summary = summarise(trial)
    soft_n, hard_n = limits_of(trial.scenario)
    crossings, longest = _above(trial, soft_n)
    block = _last_grasped(summary.actions)
    place_m = _rest_of(trial, block)
    roi_m = trial.scenario.scene.roi_m if trial.scenario.scene else (None, None)
    pulls = [heights for _, heights in _lifts(trial)]
    patient = summary.patient or None
    return Result(
        outcome=summary.outcome,
        reason=summary.reason,
        scenario_kind=summary.scenario_kind,
        complete=summary.complete and summary.lost == 0,
        visibility=summary.visibility,
        max_force_n=summary.max_force_n,
        soft_limit_n=soft_n,
        hard_limit_n=hard_n,
        crossings=crossings,
        longest_above_ticks=longest,
        plans=summary.plans,
        replans=summary.replans,
        actions=len(summary.actions),
        ticks=summary.ticks,
        grasp_block=block or None,
        grasp_x_m=place_m[0] if place_m else None,
        grasp_y_m=place_m[1] if place_m else None,
        roi_x_m=roi_m[0],
        roi_y_m=roi_m[1],
        lift_m=max(pulls[-1], default=None) if pulls else None,
        patient_max_force_n=patient.max_force_n if patient else None,
        patient_above_ticks=patient.ticks_above_limit if patient else None,
        missed_ticks=patient.missed if patient else None,
        needless_ticks=patient.needless if patient else None,
    )


def series_of(trial: Trial) -> tuple[Lifted, ...]:
    """Force and visibility against height, while an arm lifts, at every fifth tick."""
    verdicts = {one.tick: one for one in trial.verdicts}
    return tuple(
        Lifted(state.tick, height_m, verdict.max_force_n, verdict.visibility)
        for states, heights in _lifts(trial)
        for state, height_m in zip(states, heights, strict=True)
        if state.tick % EVERY_TICKS == 0 and (verdict := verdicts.get(state.tick)) is not None
    )


def planning_in(trial: Trial, timing: Timing) -> Timing:
    """Add to a trial's timing how long its plans took.

    Those through the planner are from the stamp of SA's context to that of the plan, as both lie
    in the log: the context's way, what the planner does with it, and the plan's encoding.
    """
    took_s = [plan.ground_s + plan.solve_s for plan in trial.plans]
    if not took_s:
        return timing
    asked_ns = {one.request_id: one.stamp_ns for one in trial.contexts}

    def through_s(plans: Iterable[Plan]) -> float | None:
        for plan in plans:
            began_ns = asked_ns.get(plan.request_id)
            return None if began_ns is None else (plan.stamp_ns - began_ns) / 1e9
        return None

    later = [one for one in trial.plans[1:] if one.actions]
    return msgspec.structs.replace(
        timing,
        plan_first_s=took_s[0],
        plan_median_s=median(took_s),
        plan_service_s=through_s(trial.plans[:1]),
        replan_move_s=through_s(one for one in later if not _does(one) & {"release", "grasp"}),
        replan_release_s=through_s(one for one in later if "release" in _does(one)),
    )


def _does(plan: Plan) -> set[str]:
    return {action.name for action in plan.actions}


def _above(trial: Trial, limit_n: float) -> tuple[int, int]:
    """How often the force rose above the limit in pulls, and for how many ticks at the longest."""
    verdicts: dict[int, Verdict] = {one.tick: one for one in trial.verdicts}
    crossings, longest = 0, 0
    for states in _pulls(trial):
        above = [
            (verdict := verdicts.get(one.tick)) is not None and verdict.max_force_n > limit_n
            for one in states
        ]
        runs = [sum(1 for _ in run) for is_above, run in groupby(above) if is_above]
        crossings += len(runs)
        longest = max(longest, *runs, 0)
    return crossings, longest


def _pulls(trial: Trial) -> Iterator[tuple[RobotTick, ...]]:
    for (_, action), states in groupby(trial.robot, key=lambda one: (one.goal_id, one.action)):
        if action == "pull":
            yield tuple(states)


def _lifts(trial: Trial) -> Iterator[tuple[list[RobotTick], list[float]]]:
    """Yield of each pull the states in which the arm lifts, with the heights of its tip [m]."""
    for pull in _pulls(trial):
        states = [one for one in pull if one.phase == _LIFT and one.arm in one.tips_in_world]
        if states:
            tops = [one.tips_in_world[one.arm].position_m[2] for one in states]
            yield states, [top - tops[0] for top in tops]


def _last_grasped(actions: Sequence[str]) -> str:
    """Name the block of the last grasp; empty if there was none."""
    found = (_GRASP.match(one) for one in reversed(actions))
    return next((one.group(1) for one in found if one), "")


def _rest_of(trial: Trial, block: str) -> tuple[float, float, float] | None:
    """Where a block is at rest: nothing has moved yet at the first question."""
    if not block or not trial.contexts:
        return None
    first = trial.contexts[0]
    return dict(zip(first.names, first.blocks_m, strict=False)).get(block)
