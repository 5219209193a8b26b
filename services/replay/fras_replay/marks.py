"""Places of interest in a log: plans, crossings of a limit, actions, stops, the end."""

from dataclasses import dataclass

from fras_common.messages import (
    ActionResult,
    Header,
    Holds,
    Plan,
    RobotState,
    TaskStatus,
    Verdict,
)
from fras_common.messages.replay import MarkKind

SAFE = "ok"


@dataclass(frozen=True)
class Found:
    """What a message marks."""

    kind: MarkKind
    text: str


class MarkFinder:
    """Fed a log's messages in their order, tells what each of them marks."""

    def __init__(self) -> None:
        self._level = SAFE
        self._goal = ""
        self._holds: dict[str, str] = {}
        self._ended = False

    def look(self, message: Header) -> Found | None:
        """Return what a message marks, or None."""
        match message:
            case Plan():
                return _plan(message)
            case Verdict():
                return self._verdict(message)
            case RobotState():
                return self._robot(message)
            case ActionResult():
                reason = f", {message.reason}" if message.reason else ""
                return Found("action_end", f"{_action(message)} {message.outcome}{reason}")
            case Holds():
                return self._hold(message)
            case TaskStatus():
                return self._task(message)
            case _:
                return None

    def _verdict(self, verdict: Verdict) -> Found | None:
        before, self._level = self._level, verdict.level
        if verdict.level in (before, SAFE):
            return None
        return Found(
            "crossing",
            f"{verdict.level}: {verdict.max_force_n:.2f} N of {verdict.limit_n:.2f} N"
            + (f", {verdict.reason}" if verdict.reason else ""),
        )

    def _robot(self, robot: RobotState) -> Found | None:
        goal = robot.action.goal_id if robot.action is not None else ""
        if robot.action is None or goal == self._goal:
            return None
        self._goal = goal
        return Found("action_start", _action(robot.action))

    def _hold(self, message: Holds) -> Found | None:
        before, self._holds = self._holds, message.holds
        if message.holds == before:
            return None
        new = [f"{who}: {why}" for who, why in message.holds.items() if before.get(who) != why]
        if new:
            return Found("hold", "; ".join(new))
        return Found("resume", ", ".join(sorted(before.keys() - message.holds.keys())))

    def _task(self, status: TaskStatus) -> Found | None:
        was, self._ended = self._ended, status.phase in ("ended", "idle")
        if was or status.phase != "ended":
            return None
        return Found("ended", f"{status.outcome} {status.reason}".rstrip())


def _plan(plan: Plan) -> Found:
    steps = " → ".join(action.text for action in plan.actions) or "no plan"
    if plan.reason == "initial":
        return Found("plan", steps)
    return Found("re_plan", f"{plan.reason}: {steps}")


def _action(named: object) -> str:
    name, arm, block = (str(getattr(named, field)) for field in ("name", "arm", "block"))
    return f"{name}({arm},{block})" if block else f"{name}({arm})"
