"""What a goal must fulfil before its way is even looked at: each check refuses by its own name."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from math import isfinite

from fras_motion.errors import Refused
from fras_motion.states import Goal

__all__ = [
    "Check",
    "Situation",
    "busy",
    "hard_latch",
    "not_finite",
    "unknown_action",
    "unknown_arm",
]


@dataclass(frozen=True)
class Situation:
    """What a goal meets.

    Parameters
    ----------
    running : Goal or None
        The action under way.
    actions, arms : collection of str
        What there is.
    hard_latched : bool
        Whether the hard force limit was crossed and nothing released since.
    """

    running: Goal | None
    actions: Collection[str]
    arms: Collection[str]
    hard_latched: bool


Check = Callable[[Goal, Situation], None]


def busy(goal: Goal, situation: Situation) -> None:
    """Take one action at a time.

    Parameters
    ----------
    goal, situation
        The goal to judge and what it meets.

    Raises
    ------
    Refused
        Another action runs.
    """
    del goal
    if (running := situation.running) is not None:
        raise Refused(
            "busy",
            f"{running.name} of {running.arm} (goal {running.goal_id}) runs; await its result",
            goal_id=running.goal_id,
        )


def unknown_action(goal: Goal, situation: Situation) -> None:
    """Do no more than the actions that there are.

    Parameters
    ----------
    goal, situation
        The goal to judge and what it meets.

    Raises
    ------
    Refused
        Of another name.
    """
    if goal.name not in situation.actions:
        known = ", ".join(situation.actions)
        raise Refused("unknown_action", f"{goal.name!r}; there are {known}", action=goal.name)


def unknown_arm(goal: Goal, situation: Situation) -> None:
    """Move no more than the arms that there are.

    Parameters
    ----------
    goal, situation
        The goal to judge and what it meets.

    Raises
    ------
    Refused
        Of another arm.
    """
    if goal.arm not in situation.arms:
        known = ", ".join(situation.arms)
        raise Refused("unknown_arm", f"{goal.arm!r}; there are {known}", arm=goal.arm)


def hard_latch(goal: Goal, situation: Situation) -> None:
    """After a crossed hard limit, let go first.

    Parameters
    ----------
    goal, situation
        The goal to judge and what it meets.

    Raises
    ------
    Refused
        Anything but a release.
    """
    if situation.hard_latched and goal.name != "release":
        raise Refused(
            "hard_latch",
            f"the hard force limit was crossed: {goal.name} has to wait for a release",
            action=goal.name,
        )


def not_finite(goal: Goal, situation: Situation) -> None:
    """Go nowhere that is no place.

    Parameters
    ----------
    goal, situation
        The goal to judge and what it meets.

    Raises
    ------
    Refused
        NaN or infinity in the target.
    """
    del situation
    if goal.target_m is not None and not all(isfinite(x) for x in goal.target_m):
        raise Refused("not_finite", f"target {goal.target_m}", target_m=goal.target_m)
