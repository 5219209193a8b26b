"""What the verdict on the tissue asks of a running action."""

from __future__ import annotations

from enum import Enum

__all__ = ["LEVELS", "Reaction", "force_relieved", "required_reaction"]

#: Levels of a verdict (design, section 4).
LEVELS: tuple[str, ...] = ("ok", "soft", "hard", "invalid")


class Reaction(Enum):
    """What an action has to do next."""

    GO_ON = "go on"
    RETREAT = "stop, then retreat"
    ABORT = "stop, then abort"


def required_reaction(level: str, action: str) -> Reaction:
    """Reaction to a verdict.

    Parameters
    ----------
    level : str
        Level of the verdict: ok, soft, hard, or anything else, which is taken for invalid.
    action : str
        Name of the running action.

    Returns
    -------
    Reaction
        A release goes on at any level: opening the jaw takes force off the tissue. The soft
        limit binds the pull alone.
    """
    if action == "release" or level == "ok":
        return Reaction.GO_ON
    if level == "soft":
        return Reaction.RETREAT if action == "pull" else Reaction.GO_ON
    return Reaction.RETREAT if level == "hard" else Reaction.ABORT


def force_relieved(force_n: float, limit_n: float, ratio: float) -> bool:
    """Whether a retreat may end.

    Parameters
    ----------
    force_n, limit_n : float
        The force the tissue bears and the soft limit [N].
    ratio : float
        The share of the limit a retreat goes down to.

    Returns
    -------
    bool
        False also where the force is no number, which the wire tells as a negative one.
    """
    return 0.0 <= force_n <= ratio * limit_n
