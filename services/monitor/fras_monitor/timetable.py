"""The plans of a trial as a timetable: what is done, what is under way, what is to come."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from fras_common.messages import DoneAction, Plan, TaskStatus
from fras_monitor.picture import Picture
from fras_monitor.words import action_in_words, instrument, plain, point, reason_in_words, sentence

RowState = Literal["done", "stopped", "current", "next", "dropped"]

_OUTCOMES: Final = {
    "failed": "did not succeed",
    "interrupted": "stopped on the way",
    "aborted": "broken off",
}


@dataclass(frozen=True)
class Row:
    """One action in words, what became of it, and why if it was not simply done."""

    text: str
    state: RowState
    note: str = ""


@dataclass(frozen=True)
class Section:
    """One plan: its heading, why it was made, and its actions in order."""

    title: str
    reason: str
    rows: tuple[Row, ...]


def timetable(picture: Picture) -> tuple[Section, ...]:
    """Tell the plans of the current trial, oldest first.

    Notes
    -----
    What was done stands in the executive's status, which a page that is opened late gets, too;
    of plans before that time it knows no more than what was done by them.
    """
    task = picture.of_trial(picture.task)
    if task is None:
        return ()
    plans = {one.request_id: one for one in picture.plans if one.trial == picture.trial}
    order = list(dict.fromkeys([*(done.plan for done in task.done), *plans]))
    # A status arrives before the plan it speaks of, or after: keys have no order among them.
    followed = task.plan or (order[-1] if order else "")
    return tuple(
        _section(picture, task, number, plan_id, plans.get(plan_id), current=plan_id == followed)
        for number, plan_id in enumerate(order, start=1)
    )


def changes(before: Plan, after: Plan) -> list[str]:
    """Tell, in sentences, what a plan does otherwise than the one before it."""
    if is_end(after):
        return [sentence(f"No new plan is needed: {cause(after)}")]
    told = [sentence(f"New plan because {cause(after)}")]
    told += [
        f"{point(block).capitalize()} is not tried again."
        for block in after.tried
        if block not in before.tried
    ]
    if before.ignore_ap and not after.ignore_ap:
        told.append("Attachments, which the first plan ignored, count from now on.")
    if after.actions and before.target and after.target and before.target != after.target:
        told.append(
            f"The tissue is held at {point(after.target)} instead of {point(before.target)}."
        )
    if after.actions and before.arm and after.arm and before.arm != after.arm:
        told.append(f"The {instrument(after.arm)} works instead of the {instrument(before.arm)}.")
    return told


def is_end(plan: Plan) -> bool:
    """Whether a plan found the goal reached, so that nothing is left to do."""
    return not plan.actions and plan.no_plan is None


def cause(plan: Plan) -> str:
    """Tell why a plan was made, with what was found as it was made.

    Notes
    -----
    In words of the past, which stay true: a plan is read for as long as the trial is shown.
    """
    told = reason_in_words(plan.reason)
    if is_end(plan):
        return f"{told}, and the target region was exposed"
    if plan.reason != "exposure":
        return told
    left = "the target region was not yet exposed" if plan.goal == "visible" else "more was to do"
    return f"{told}, and {left}"


def latest_changes(picture: Picture) -> list[str]:
    """Tell what the latest plan changed; nothing for a first plan."""
    plans = [one for one in picture.plans if one.trial == picture.trial]
    return changes(plans[-2], plans[-1]) if len(plans) > 1 else []


def why(plan: Plan) -> list[str]:
    """Tell why this plan, or why there is none."""
    said = plan.no_plan.sentences if plan.no_plan is not None else plan.explanation
    return [sentence(plain(one)) for one in said]


def _section(
    picture: Picture,
    task: TaskStatus,
    number: int,
    plan_id: str,
    plan: Plan | None,
    *,
    current: bool,
) -> Section:
    done = [one for one in task.done if one.plan == plan_id]
    rows = [*_done_rows(picture, done)]
    if plan is not None:
        left = plan.actions[len(done) :]
        under_way = current and task.phase == "acting" and bool(task.action)
        rows += _rows_ahead([one.text for one in left], under_way=under_way, current=current)
    if plan is None:
        return Section(f"Plan {number}", "", tuple(rows))
    title = "Nothing more to do" if is_end(plan) else f"Plan {number}"
    return Section(title, sentence(cause(plan)), tuple(rows))


def _done_rows(picture: Picture, done: Sequence[DoneAction]) -> Iterator[Row]:
    results = {one.goal_id: one for one in picture.results if one.trial == picture.trial}
    for one in done:
        result = results.get(f"g{one.goal}")
        if result is None or result.outcome == "succeeded":
            yield Row(action_in_words(one.action), "done")
        else:
            why_not = reason_in_words(result.reason) if result.reason else ""
            note = _OUTCOMES[result.outcome] + (f": {why_not}" if why_not else "")
            yield Row(action_in_words(one.action), "stopped", note)


def _rows_ahead(texts: Sequence[str], *, under_way: bool, current: bool) -> list[Row]:
    rows: list[Row] = []
    for index, text in enumerate(texts):
        if not current:
            rows.append(Row(action_in_words(text), "dropped", "no longer carried out"))
        elif under_way and index == 0:
            rows.append(Row(action_in_words(text, under_way=True), "current"))
        else:
            rows.append(Row(action_in_words(text), "next"))
    return rows
