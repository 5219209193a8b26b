"""What is known of a cell, as values: messages and their arrival times go in, nothing is asked.

Each message is kept with its trial; whoever looks sees those of the current trial only, so that
the order in which keys arrive does not matter and nothing of an old trial looks new.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final, Generic, TypeVar

import msgspec

from fras_common.messages import (
    ActionResult,
    Context,
    Header,
    Health,
    Holds,
    Plan,
    RecorderStatus,
    ReplayStatus,
    RobotState,
    SupervisorStatus,
    TaskStatus,
    TissueModel,
    TissueState,
    Verdict,
    WhyNotReply,
)
from fras_monitor.trace import Trace

M = TypeVar("M")

PLANS_KEPT: Final = 20
RESULTS_KEPT: Final = 200


@dataclass(frozen=True)
class Heard(Generic[M]):
    """A message and when it arrived, by a clock that never goes back [s]."""

    message: M
    at_s: float


@dataclass(frozen=True)
class Picture:
    """The latest of everything.

    Attributes
    ----------
    plans, results : tuple
        The last ones, oldest first; of a page opened late only those since then.
    health : mapping of service to its last word
    processes : mapping of host to its supervisor's last word
    tokens : frozenset of str
        Who is there, with instance: `alive/sim/3f2a`.
    replay : Heard[ReplayStatus] or None
        Where the replay stands that the cell is fed by; None in a live one.
    answer : WhyNotReply or None
        The last answer to a question of this page.
    """

    model: Heard[TissueModel] | None = None
    tissue: Heard[TissueState] | None = None
    robot: Heard[RobotState] | None = None
    verdict: Heard[Verdict] | None = None
    context: Heard[Context] | None = None
    task: Heard[TaskStatus] | None = None
    holds: Heard[Holds] | None = None
    log: Heard[RecorderStatus] | None = None
    plans: tuple[Plan, ...] = ()
    results: tuple[ActionResult, ...] = ()
    health: Mapping[str, Heard[Health]] = field(default_factory=dict[str, Heard[Health]])
    processes: Mapping[str, Heard[SupervisorStatus]] = field(
        default_factory=dict[str, Heard[SupervisorStatus]]
    )
    tokens: frozenset[str] = frozenset()
    replay: Heard[ReplayStatus] | None = None
    answer: WhyNotReply | None = None
    trace: Trace = field(default_factory=Trace)

    @property
    def trial(self) -> str:
        """The trial that the executive speaks of, else that of the arms or the tissue."""
        known: tuple[Heard[Any] | None, ...] = (self.task, self.robot, self.model)
        return next((one.message.trial for one in known if one and one.message.trial), "")

    @property
    def is_replay(self) -> bool:
        """Whether a log is played back into the cell."""
        return self.is_there("replay")

    @property
    def is_remembered(self) -> bool:
        """Whether the recorder can tell what was not heard: it remembers nothing of a replay."""
        return self.is_there("recorder") and not self.is_replay

    def is_there(self, service: str) -> bool:
        """Whether some instance of a service shows that it lives."""
        return any(one.startswith(f"alive/{service}/") for one in self.tokens)

    @property
    def plan(self) -> Plan | None:
        """The latest plan of the trial."""
        return next((one for one in reversed(self.plans) if one.trial == self.trial), None)

    @property
    def dt_s(self) -> float:
        """Length of a tick; 0 while it is not known."""
        model = self.of_trial(self.model)
        return model.dt_s if model is not None else 0.0

    @property
    def tick(self) -> int:
        """That of the arms' last state; -1 before any."""
        return self.robot.message.tick if self.robot is not None else -1

    @property
    def simulated_s(self) -> float:
        """Up to where the trial has come, as far as it is judged or its arms were heard."""
        heard = (self.of_trial(self.robot), self.of_trial(self.verdict))
        return max((one.tick for one in heard if one is not None), default=0) * self.dt_s

    @property
    def is_behind(self) -> bool:
        """Whether a verdict was heard on states that were not."""
        verdict = self.of_trial(self.verdict)
        states = (self.of_trial(self.robot), self.of_trial(self.tissue))
        return verdict is not None and any(one and one.tick < verdict.tick for one in states)

    def of_trial(self, heard: "Heard[H] | None") -> "H | None":
        """Return a message if it belongs to the current trial."""
        belongs = heard is not None and heard.message.trial == self.trial
        return heard.message if heard is not None and belongs else None


H = TypeVar("H", bound=Header)

# Which field holds the latest message of a type.
_LATEST: Final[Mapping[type, str]] = {
    TissueModel: "model",
    TissueState: "tissue",
    RobotState: "robot",
    Verdict: "verdict",
    Context: "context",
    TaskStatus: "task",
    Holds: "holds",
    RecorderStatus: "log",
}


def apply(picture: Picture, message: object, now_s: float) -> Picture:
    """Take in one message.

    Parameters
    ----------
    picture : Picture
    message : object
        A message of the topic table, or an answer to a question of this page.
    now_s : float
        When it arrived.

    Raises
    ------
    TypeError
        It is of a type that no key of this page carries.
    """
    match message:
        case Plan():
            return replace(picture, plans=(*picture.plans, message)[-PLANS_KEPT:])
        case ActionResult():
            return replace(picture, results=(*picture.results, message)[-RESULTS_KEPT:])
        case Health():
            health = {**picture.health, message.service: Heard(message, now_s)}
            return replace(picture, health=health)
        case SupervisorStatus():
            processes = {**picture.processes, message.host: Heard(message, now_s)}
            return replace(picture, processes=processes)
        case WhyNotReply():
            return replace(picture, answer=message)
        case ReplayStatus():
            return replace(picture, replay=Heard(_with_marks(picture.replay, message), now_s))
        case _ if (name := _LATEST.get(type(message))) is not None:
            news: dict[str, Any] = {name: Heard(message, now_s)}
            if isinstance(message, Verdict):
                news["trace"] = picture.trace.extended(message)
            return replace(picture, **news)
        case _:
            raise TypeError(f"no key of this page carries a {type(message).__name__}")


def remembered(picture: Picture, message: object) -> Picture:
    """Take in what the recorder remembers: it counts only where nothing later has been heard.

    In a replay only where nothing has been heard: a recorder there remembers what was before it.
    """
    name = _LATEST.get(type(message), "")
    if not name or not isinstance(message, Header):
        return picture
    heard: Heard[Header] | None = getattr(picture, name)
    if heard is not None and (picture.is_replay or message.stamp_ns <= heard.message.stamp_ns):
        return picture
    return apply(picture, message, 0.0)


def with_token(picture: Picture, token: str, present: bool) -> Picture:
    """Note that a liveliness token, `alive/sim/3f2a`, came or went."""
    tokens = picture.tokens | {token} if present else picture.tokens - {token}
    noted = replace(picture, tokens=tokens)
    return noted if noted.is_replay else replace(noted, replay=None)


def _with_marks(before: Heard[ReplayStatus] | None, now: ReplayStatus) -> ReplayStatus:
    """Keep the marks of a log, which are told once."""
    if now.marks or before is None or before.message.log != now.log:
        return now
    return msgspec.structs.replace(now, marks=before.message.marks)
