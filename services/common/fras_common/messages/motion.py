"""Commands to motion and their results."""

from typing import Literal

import msgspec

from fras_common.messages.base import Header, Vec3, Wire, require_finite

ActionOutcome = Literal["succeeded", "failed", "interrupted", "aborted"]


class ExecuteRequest(Wire, frozen=True, kw_only=True):
    """One action for one arm; `target_m` in the world frame for reach and move."""

    trial: str
    goal_id: str
    name: str
    arm: str
    block: str
    target_m: Vec3 | None

    def __post_init__(self) -> None:
        if self.target_m is not None:
            require_finite("target_m", *self.target_m)


class ExecuteReply(Wire, frozen=True, kw_only=True):
    """Whether the goal was accepted, and if not, the named reason.

    Attributes
    ----------
    reason : str
        Name of the safeguard that refused; empty else.
    text : str
        What it says, for people.
    values : dict
        The numbers and names behind the text.
    """

    accepted: bool
    reason: str
    text: str = ""
    values: dict[str, str] = msgspec.field(default_factory=dict[str, str])


class ActionResult(Header, frozen=True, kw_only=True):
    """How an action ended.

    Attributes
    ----------
    text : str
        What the gate, or the arm that failed, said of it; empty else.
    values : dict
        The numbers and names behind the text.
    """

    goal_id: str
    name: str
    arm: str
    block: str
    outcome: ActionOutcome
    reason: str
    text: str = ""
    values: dict[str, str] = msgspec.field(default_factory=dict[str, str])


class CancelRequest(Wire, frozen=True, kw_only=True):
    """End the trial for the arms: no further goal of it, and a running one is stopped."""

    trial: str
    reason: str


class CancelReply(Wire, frozen=True, kw_only=True):
    """The arms are at rest and nothing of the trial will move them; the last tick."""

    tick: int


class HoldRequest(Wire, frozen=True, kw_only=True):
    """Stop; `holder` owns this hold until it is lifted."""

    holder: str
    reason: str


class ResumeRequest(Wire, frozen=True, kw_only=True):
    """Lift the hold of `holder`; `by` says who asks."""

    holder: str
    by: str


class Holds(Header, frozen=True, kw_only=True):
    """Everyone who holds the arms, holder to reason; latched, and restored by a new motion."""

    holds: dict[str, str]


class HoldState(Wire, frozen=True, kw_only=True):
    """Holds in force after the request, holder to reason, and the tick that was current."""

    holds: dict[str, str]
    tick: int
