"""From a trial's log to its numbers."""

import re
from collections.abc import Iterator, Sequence
from itertools import groupby
from statistics import median
from typing import Final

from fras_cli.report import Trial, summarise
from fras_cli.report.trial import RobotTick
from fras_common.messages import Verdict
from fras_experiments.campaign.records import Lifted, Result, limits_of

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


def plan_times_s(trial: Trial) -> tuple[float | None, float | None]:
    """Grounding and solving: of the first plan, and the median over all [s]."""
    took_s = [plan.ground_s + plan.solve_s for plan in trial.plans]
    return (took_s[0], median(took_s)) if took_s else (None, None)


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
