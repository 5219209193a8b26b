"""Small logs for the tests of the replay: ticks of three keys, latched ones between them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fras_common.bus import RawSample
from fras_common.codec import encode
from fras_common.messages import (
    Header,
    Holds,
    LogRecord,
    Plan,
    PlannedAction,
    RobotState,
    ServoJaw,
    Verdict,
)
from fras_common.messages.robot import ActionState
from fras_common.messages.sa import Level
from fras_log import LogFile
from support import verdicts

PACKED = "application/msgpack"
TRIAL = "t-1"
START_NS = 1_000_000_000_000
TICK_NS = 20_000_000


@dataclass(frozen=True)
class Said:
    """A message of a log, and when it came [ns since the log's first]."""

    key: str
    payload: bytes
    at_ns: int
    encoding: str = PACKED


def robot(tick: int, action: ActionState | None = None, trial: str = TRIAL) -> RobotState:
    return RobotState(
        tick=tick, trial=trial, seq=tick, source="motion/old", stamp_ns=tick, arms={},
        action=action, holds={}, verdict_tick=tick - 1,
    )  # fmt: skip


def verdict(tick: int, level: Level = "ok") -> Verdict:
    return verdicts.verdict(
        tick, TRIAL, level, seq=tick, source="sa/old", stamp_ns=tick, max_force_n=0.51
    )


def plan(reason: str, seq: int = 0) -> Plan:
    action = PlannedAction(t=1, text="grasp(psm1)", name="grasp", args=["psm1"], expected=[])
    return Plan(
        trial=TRIAL, seq=seq, source="planner/old", request_id="c1", reason=reason,
        criterion="weighted", goal="visible", ignore_ap=False, tried=[], actions=[action],
        target="", arm="psm1", history=[], cost=[], models=1, ground_s=0.0, solve_s=0.0,
        explanation=[], no_plan=None, asp_digest="",
    )  # fmt: skip


def action(goal_id: str) -> ActionState:
    return ActionState(goal_id=goal_id, name="grasp", arm="psm1", block="b(1,1)", phase="close")


def said(key: str, message: Header, at_ns: int) -> Said:
    return Said(key, encode(message), at_ns)


def tick_of(number: int, at_ns: int, level: Level = "ok", goal: str = "") -> list[Said]:
    """A tick's robot state and verdict, 8 ms apart."""
    state = robot(number, action(goal) if goal else None)
    return [
        said("robot/state", state, at_ns),
        said("sa/verdict", verdict(number, level), at_ns + 8_000_000),
    ]


def short_trial() -> list[Said]:
    """Ten ticks: a plan before tick 0 and a re-plan after tick 4, a crossing, a stop, a command."""
    log = LogRecord(source="sa/old", level="warning", event="late", fields={})
    messages = [said("log/sa", log, 0), said("planner/plan", plan("initial"), 1_000_000)]
    for number in range(10):
        level: Level = "soft" if number == 3 else "ok"
        goal = "g1" if number < 5 else "g2"
        messages += tick_of(number, 10_000_000 + number * TICK_NS, level, goal)
        at_ns = messages[-1].at_ns
        if number == 4:
            messages.append(said("planner/plan", plan("force", 1), at_ns + 1_000_000))
        if number == 6:
            stop = Holds(source="motion/old", holds={"cli": "stop pressed"})
            messages.append(said("motion/holds", stop, at_ns + 1_000_000))
            told = ServoJaw(source="client/old", jaw_rad=0.1)
            messages.append(said("psm1/jaw/servo_jp", told, at_ns + 2_000_000))
    return messages


def write_log(path: Path, messages: Sequence[Said], trial: str = TRIAL) -> Path:
    """Write a log as the recorder does."""
    log = LogFile(path, {"trial": trial}, {}, START_NS)
    for one in messages:
        log.write(RawSample(one.key, one.payload, one.encoding), START_NS + one.at_ns)
    log.close({"reason": "closed"})
    return path
