"""What the executive asks the world to do: it yields an effect, the shell sends back what came."""

from dataclasses import dataclass
from typing import Any

from fras_common.messages import Plan, TaskStatus
from fras_common.topics import Query


@dataclass(frozen=True)
class Ask:
    """Ask `query`; sends back the reply, throws `RemoteFault` or `NoAnswer`.

    A patient one is asked again while the service that serves it is away.
    """

    query: Query[Any, Any]
    request: Any
    timeout_s: float
    is_patient: bool = True


@dataclass(frozen=True)
class AwaitResult:
    """Wait for the end of an action; sends back its `ActionResult`."""

    goal_id: str


@dataclass(frozen=True)
class AwaitDecision:
    """Wait, for as long as it takes, for a person's word on a plan; sends back `PlanDecision`."""

    plan: str


@dataclass(frozen=True)
class Pause:
    """Go on after a while; `waiting_for` tells whom it is for."""

    seconds_s: float
    waiting_for: str


@dataclass(frozen=True)
class Say:
    """Publish; sends back the message as it was stamped."""

    message: Plan | TaskStatus


@dataclass(frozen=True)
class Accept:
    """The trial has begun and its log is open: answer whoever started it."""


Effect = Ask | AwaitResult | AwaitDecision | Pause | Say | Accept
