"""The table of all safeguards: what may refuse, stop or end a motion, each under its name.

The controller walks the gates and checks of this table; health counts by its names, and the page
docs/reference/safety.md and the mutation tests are held against it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from . import admission, clearance, gates
from .admission import Check
from .step import Gate

__all__ = ["CHECKS", "GATES", "SAFEGUARDS", "ActsOn", "Safeguard"]

ActsOn = Literal["goal", "path", "setpoint", "verdict", "arms", "time"]


@dataclass(frozen=True)
class Safeguard:
    """One row.

    Parameters
    ----------
    name : str
        By which it refuses and is counted.
    acts_on : str
        goal: before its way is planned; path: the planned way, before the goal is accepted;
        setpoint: the planned way, and each setpoint before it is sent; verdict; arms: whatever
        they do; time: waiting.
    guards : str
        What it does, in one sentence.
    gate : Gate or None
        Judges a step.
    check : Check or None
        Judges a goal.
    """

    name: str
    acts_on: ActsOn
    guards: str
    gate: Gate | None = None
    check: Check | None = None


_ROWS = (
    Safeguard(
        "another_trial",
        "goal",
        "A goal or verdict of another trial, or of a cancelled one, moves nothing.",
    ),
    Safeguard(
        "restart", "goal", "A motion that starts again moves nothing before its executive knows."
    ),
    Safeguard("goal_used", "goal", "A goal that was taken once in its trial moves nothing again."),
    Safeguard("busy", "goal", "One action at a time.", check=admission.busy),
    Safeguard(
        "unknown_action", "goal", "Only the five actions are done.", check=admission.unknown_action
    ),
    Safeguard(
        "unknown_arm", "goal", "Only the arms of the cell move.", check=admission.unknown_arm
    ),
    Safeguard(
        "hard_latch",
        "goal",
        "After a crossed hard limit nothing but a release is accepted.",
        check=admission.hard_latch,
    ),
    Safeguard(
        "not_finite", "goal", "A target is made of finite numbers.", check=admission.not_finite
    ),
    Safeguard("target_missing", "goal", "A reach and a move have a target."),
    Safeguard("jaw_open", "goal", "Only a jaw that has grasped pulls and moves."),
    Safeguard("jaw_closed", "goal", "Only an open jaw reaches and grasps."),
    Safeguard("unreachable", "path", "Every point of the way is within the joints' reach."),
    Safeguard("profile", "path", "The way can be timed under the limits."),
    Safeguard("joint_acceleration", "path", "No planned joint acceleration exceeds the arm's."),
    Safeguard("finite", "setpoint", "A setpoint is made of finite numbers.", gates.finite),
    Safeguard("joint_limits", "setpoint", "Joints stay in their ranges.", gates.joint_limits),
    Safeguard(
        "joint_speed",
        "setpoint",
        "Joints stay below their speeds; no joint jumps.",
        gates.joint_speed,
    ),
    Safeguard("jaw_limits", "setpoint", "The jaw stays in its range.", gates.jaw_limits),
    Safeguard("jaw_speed", "setpoint", "The jaw stays below its speed.", gates.jaw_speed),
    Safeguard("workspace", "setpoint", "The tip stays in the workspace box.", gates.workspace),
    Safeguard(
        "cartesian_speed",
        "setpoint",
        "The tip stays below its speed; it does not jump.",
        gates.cartesian_speed,
    ),
    Safeguard("orientation", "setpoint", "The tip keeps its orientation.", gates.orientation),
    Safeguard(
        "instrument_distance",
        "setpoint",
        "The instruments keep clear of each other.",
        clearance.instrument_distance,
    ),
    Safeguard(
        "forbidden_box",
        "setpoint",
        "No part of an instrument enters a forbidden box.",
        clearance.forbidden_box,
    ),
    Safeguard("verdict_tick", "verdict", "Only the verdict on the present tick moves the arms."),
    Safeguard("verdict_invalid", "verdict", "Without a valid verdict the arms stop."),
    Safeguard("force_soft", "verdict", "A pull that crosses the soft limit stops and gives way."),
    Safeguard(
        "force_hard", "verdict", "Any action that crosses the hard limit stops and gives way."
    ),
    Safeguard("hold", "arms", "A stop from anyone brings the arms to rest within two ticks."),
    Safeguard(
        "supervision",
        "arms",
        "Nothing moves while nobody who could stop it looks at the surgeon's page.",
    ),
    Safeguard("cancel", "arms", "A cancelled trial ends with the arms at rest."),
    Safeguard(
        "watchdog", "time", "No verdict, no tick; a peer silent for too long ends the trial."
    ),
    Safeguard("hold_timeout", "time", "A stop that nobody lifts ends the trial."),
)

#: Every safeguard, by name.
SAFEGUARDS: dict[str, Safeguard] = {row.name: row for row in _ROWS}

#: What each step has to pass, in the order in which it is asked.
GATES: dict[str, Gate] = {row.name: row.gate for row in _ROWS if row.gate is not None}

#: What each goal has to pass, in the order in which it is asked.
CHECKS: dict[str, Check] = {row.name: row.check for row in _ROWS if row.check is not None}
