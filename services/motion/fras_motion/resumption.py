"""What a motion that starts again must know: who held the arms, and where they were in a trial."""

from dataclasses import dataclass

import msgspec

from fras_common import messages as m
from fras_common.codec import MalformedMessage
from fras_common.errors import FrasError
from fras_common.messages.motion import ActionOutcome
from fras_common.service.recall import Asked, Last, LastAsked, Recalling, Since, under_way
from fras_common.topics import (
    ACTION_RESULT,
    CANCEL,
    HOLD,
    HOLDS,
    MOTION_RESET,
    PATIENT,
    RESUME,
    ROBOT_STATE,
    TISSUE_STATE,
    VERDICT,
)
from fras_motion.holds import RESTART, UNREADABLE

__all__ = ["Left", "TakenUp", "given_up", "interrupted", "recall_holds", "take_up"]


class NoStandpoint(FrasError):
    """A trial whose last robot state can't be recalled, or is not the last that was said."""


@dataclass(frozen=True)
class Left:
    """A trial that another motion left in the middle.

    Parameters
    ----------
    asked : Asked
        The reset that began it.
    state : RobotState
        The last that it said.
    result : ActionResult or None
        To say: how the action ended that was under way, or the last one again.
    used : frozenset of str
        Goals that it had taken.
    """

    asked: Asked
    state: m.RobotState
    result: m.ActionResult | None
    used: frozenset[str]


@dataclass(frozen=True)
class TakenUp:
    """All that was recalled.

    Parameters
    ----------
    left : Left or None
        The trial to go on with.
    lost : ActionResult or None
        Where there is a trial, but no going on: how its action ended.
    problem : str
        Why.
    """

    left: Left | None = None
    lost: m.ActionResult | None = None
    problem: str = ""


def recall_holds() -> Recalling:
    """Recall who held the arms, and why; returns them, holder to reason.

    Before anything else: until then a stop that is pressed now is not told to the recorder.
    """
    try:
        said: m.Holds | None = yield Last(HOLDS)
        asked: Asked | None = yield LastAsked(HOLD)
        lifted: Asked | None = yield LastAsked(RESUME)
    except MalformedMessage as error:
        # Nobody can tell any more who held the arms: a person has to look, the executive may not.
        return {UNREADABLE: f"the last holds can't be read: {error}"}
    holds = dict(said.holds) if said is not None else {}
    # One that was killed before it had recalled has acknowledged what it did not tell as its holds.
    if asked is not None and asked.reply is not None and _is_later(asked, said):
        early = dict(asked.reply.holds)
        if lifted is not None and lifted.reply is not None and _is_later(lifted, asked.record):
            early.pop(lifted.request.holder, None)
        holds |= early
    return holds


def _is_later(asked: Asked, other: m.Header | None) -> bool:
    return other is None or asked.record.stamp_ns > other.stamp_ns


def take_up() -> Recalling:
    """Recall the trial under way; returns `TakenUp`."""
    status: m.TaskStatus | None = None
    try:
        status = yield from under_way()
        left: Left | None = (yield from _left(status)) if status is not None else None
    except (MalformedMessage, NoStandpoint) as error:
        lost = interrupted(status, "aborted", "hold:motion") if status is not None else None
        return TakenUp(lost=lost, problem=str(error))
    return TakenUp(left)


def _left(status: m.TaskStatus) -> Recalling:
    """Recall where the trial stands; None if it is not yet motion's, or not any more."""
    reset: Asked | None = yield LastAsked(MOTION_RESET)
    if reset is None or reset.reply is None or reset.request.trial != status.trial:
        if status.phase == "resetting":
            return None
        raise NoStandpoint(f"the reset of trial {status.trial!r} is not remembered")
    cancelled: Asked | None = yield LastAsked(CANCEL)
    if cancelled is not None and cancelled.request.trial == status.trial:
        return None
    state: m.RobotState | None = yield Last(ROBOT_STATE)
    if state is None or state.trial != status.trial:
        raise NoStandpoint(f"no robot state of trial {status.trial!r} is remembered")
    for topic in (TISSUE_STATE, PATIENT.state, VERDICT):
        answer: m.Header | None = yield Last(topic)
        if answer is not None and answer.trial == status.trial and answer.tick > state.tick:
            raise NoStandpoint(
                f"{topic.key} came up to tick {answer.tick}, and the last robot state that is "
                f"remembered is of tick {state.tick}"
            )
    told: list[m.ActionResult] = yield Since(ACTION_RESULT, -1)
    ends = [one for one in told if one.trial == status.trial]
    ended = ends[-1] if ends else None
    runs = status.phase == "acting" and (ended is None or ended.goal_id != status.goal_id)
    result = interrupted(status, "interrupted", RESTART, state.tick) if runs else ended
    # Each goal that was taken has ended, but for the one under way.
    used = frozenset(one.goal_id for one in (*ends, *([result] if result is not None else ())))
    return Left(reset, state, result, used)


def given_up(result: m.ActionResult) -> m.ActionResult:
    """Say that there is no going on after a restart, instead of how the action ended."""
    return msgspec.structs.replace(result, outcome="aborted", reason="hold:motion")


def interrupted(
    status: m.TaskStatus, outcome: ActionOutcome, reason: str, tick: int = -1
) -> m.ActionResult | None:
    """Say how the action ended that a status tells to be under way; None if it tells of none."""
    if not status.goal_id:
        return None
    name, _, arguments = status.action.removesuffix(")").partition("(")
    arm, _, block = arguments.partition(",")
    return m.ActionResult(
        tick=max(tick, status.tick),
        trial=status.trial,
        goal_id=status.goal_id,
        name=name,
        arm=arm,
        block=block,
        outcome=outcome,
        reason=reason,
        text="motion started again",
    )
