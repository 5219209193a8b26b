"""Motion re-computed from audit logs alone: kinematics, limits, and no motion without a verdict."""

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks import psm_reference as psm

from fras_cli.trial import TrialView
from support.motion_audit import CHECKS, audit
from support.motion_log import MotionLog, phases, read_motion

HARD = Path(__file__).parent / "hard.toml"


def stop_in_mid_motion(trials: Any) -> Callable[[TrialView], None]:
    """Hold in the middle of a traverse, and lift the hold when the arms have stopped."""
    from fras_common.messages import HoldRequest, ResumeRequest
    from fras_common.topics import HOLD, RESUME

    bus = trials.stack.link.bus
    held: list[int] = []
    lifted: list[int] = []

    def look(view: TrialView) -> None:
        state = view.robot
        if lifted or state is None or state.action is None:
            return
        if not held and state.action.phase == "traverse" and state.tick >= 20:  # at full speed
            held.append(bus.query(HOLD, HoldRequest(holder="cli", reason="test"), 5.0).tick)
        elif held and state.action.phase in ("stop", "held"):
            lifted.append(bus.query(RESUME, ResumeRequest(holder="cli", by="cli"), 5.0).tick)

    return look


@pytest.fixture(scope="module")
def logs(trials: Any) -> dict[str, MotionLog]:
    """Trials that cross the soft and the hard limit, release and grasp anew, and are held."""
    ran: dict[str, tuple[Any, Path]] = {
        "soft": trials.kept("b"),
        "hard": trials.kept(str(HARD)),
        "release": trials.kept("c"),
        "held": trials.run("a", stop_in_mid_motion(trials), pace=1, mesh="11,13,2"),
    }
    return {name: read_motion(log) for name, (_, log) in ran.items()}


@pytest.mark.parametrize("name", ["soft", "hard", "release", "held"])
def test_every_tick_of_a_log_keeps_to_everything(logs: dict[str, MotionLog], name: str) -> None:
    log = logs[name]
    assert audit(log) == {}
    assert len(log.ticks) > 200
    moved = [arm for arm in psm.BASES if np.ptp(joints(log, arm), axis=0).max() > 0]
    assert moved


def joints(log: MotionLog, arm: str) -> Any:
    return np.array([state["arms"][arm]["setpoint_joints"] for state in log.states])


def test_the_logs_hold_what_they_are_for(logs: dict[str, MotionLog]) -> None:
    levels = {name: {one["level"] for one in log.verdicts} for name, log in logs.items()}
    assert "soft" in levels["soft"]
    assert "hard" in levels["hard"]
    assert {"stop", "retreat", "interrupted"} <= set(phases(logs["soft"]))
    assert {"stop", "retreat", "interrupted"} <= set(phases(logs["hard"]))
    assert {"open", "close"} <= set(phases(logs["release"]))
    held = logs["held"]
    assert any(state["holds"] for state in held.states)
    assert len(held.states) > len(held.ticks)
    assert "stop" in phases(held)


# How a log could lie, and which check says so. Each forgery changes a decoded log at `at`, a tick
# in the middle of the lift of a pull.
Forgery = Callable[[MotionLog, int], None]
ARM = "psm1"


def shift_joint(log: MotionLog, at: int) -> None:
    values = list(log.states[at]["arms"][ARM]["joints"])
    log.states[at]["arms"][ARM]["joints"] = [values[0] + 1e-9, *values[1:]]


def turn_tip(log: MotionLog, at: int) -> None:
    pose = log.states[at]["arms"][ARM]["tip_in_world"]
    x, y, z, w = pose["quaternion_xyzw"]
    pose["quaternion_xyzw"] = [x, y, z, w + 1e-9]


def drop_verdict(log: MotionLog, at: int) -> None:
    log.verdicts[:] = [one for one in log.verdicts if one["tick"] != at]


def older_verdict(log: MotionLog, at: int) -> None:
    log.states[at]["verdict_tick"] -= 1


def later_verdict(log: MotionLog, at: int) -> None:
    log.verdicts[at]["stamp_ns"] = log.states[at + 1]["stamp_ns"] + 1


def crossed(level: str) -> Forgery:
    def forge(log: MotionLog, at: int) -> None:
        log.verdicts[at]["level"] = level

    return forge


def went_on(log: MotionLog, at: int) -> None:
    log.states[at]["action"]["phase"] = "stop"


def drop_tick(log: MotionLog, at: int) -> None:
    del log.states[at]


def drop_first(log: MotionLog, at: int) -> None:
    del at, log.states[0]


def move_within_tick(log: MotionLog, at: int) -> None:
    again = copy.deepcopy(log.states[at])
    again["arms"][ARM]["setpoint_jaw_rad"] += 1e-9
    log.states.insert(at + 1, again)


def teleport(log: MotionLog, at: int) -> None:
    for state in log.states[at:]:
        for field in ("joints", "setpoint_joints"):
            values = list(state["arms"][ARM][field])
            state["arms"][ARM][field] = [values[0] + 0.2, *values[1:]]


def nudge(joint: int, by: float) -> Forgery:
    def forge(log: MotionLog, at: int) -> None:
        log.states[at]["arms"][ARM]["setpoint_joints"][joint] += by

    return forge


def beyond(field: str) -> Forgery:
    def forge(log: MotionLog, at: int) -> None:
        fields = log.states[at]["arms"][ARM]
        fields[field] = [2.0] * 6 if "joints" in field else 2.0

    return forge


def other_velocity(log: MotionLog, at: int) -> None:
    log.states[at]["arms"][ARM]["joint_velocities"][0] += 1e-6


def fast_joint(log: MotionLog, at: int) -> None:
    log.states[at]["arms"][ARM]["joint_velocities"][2] = 0.3


def jump(log: MotionLog, at: int) -> None:
    log.states[at]["arms"][ARM]["tip_in_world"]["position_m"][0] += 1e-3


def nobody(log: MotionLog, at: int) -> None:
    log.states[at]["action"] = None


def snap_jaw(log: MotionLog, at: int) -> None:
    log.states[at]["arms"][ARM]["setpoint_jaw_rad"] += 0.1


def hold_without_stop(log: MotionLog, at: int) -> None:
    for state in log.states[at:]:
        state["holds"] = {"page": "stop"}
        for fields in state["arms"].values():
            fields["operating_state"] = "PAUSED"


def hold_untold(log: MotionLog, at: int) -> None:
    log.states[at]["holds"] = {"page": "stop"}


def move_other_arm(log: MotionLog, at: int) -> None:
    for state in log.states[at:]:
        state["arms"]["psm2"]["setpoint_joints"][5] += 1e-9


FORGERIES: list[tuple[str, Forgery, str]] = [
    ("tips_by_forward_kinematics", shift_joint, "the tip is elsewhere"),
    ("tips_by_forward_kinematics", turn_tip, "turned otherwise"),
    ("moved_on_a_verdict", drop_verdict, "without a verdict"),
    ("moved_on_a_verdict", older_verdict, "on the verdict of tick"),
    ("moved_on_a_verdict", later_verdict, "before its verdict"),
    ("moved_on_a_verdict", crossed("soft"), "at level soft"),
    ("moved_on_a_verdict", crossed("hard"), "at level hard"),
    ("moved_on_a_verdict", crossed("invalid"), "at level invalid"),
    ("moved_on_a_verdict", went_on, "after a halt"),
    ("ticks_without_gaps", drop_tick, "2 ticks after"),
    ("ticks_without_gaps", drop_first, "not that of tick 0"),
    ("ticks_without_gaps", move_within_tick, "moved without a tick"),
    ("rates_within_limits", teleport, "joint too fast"),
    ("tips_within_limits", teleport, "tip too fast, as sent"),
    ("tips_within_limits", nudge(3, 2e-6), "does not point down"),
    ("tips_within_limits", nudge(2, 2e-4), "tip accelerates"),
    ("tips_within_limits", nudge(2, 3e-5), "tip jerks"),
    ("rates_within_limits", nudge(2, 1e-4), "planned joint acceleration"),
    ("rates_within_limits", other_velocity, "not the joints'"),
    ("rates_within_limits", fast_joint, "joint measured too fast"),
    ("tips_within_limits", jump, "tip too fast, as measured"),
    ("moved_on_a_verdict", nobody, "a tick without an action"),
    ("rates_within_limits", snap_jaw, "jaw too fast"),
    ("rates_within_limits", snap_jaw, "jaw acceleration"),
    ("joints_within_limits", beyond("joints"), "joints of yaw"),
    ("joints_within_limits", beyond("setpoint_joints"), "setpoint_joints of insertion"),
    ("joints_within_limits", beyond("jaw_rad"), "jaw_rad beyond"),
    ("joints_within_limits", beyond("setpoint_jaw_rad"), "setpoint_jaw_rad beyond"),
    ("no_motion_while_held", hold_without_stop, "moved while held"),
    ("no_motion_while_held", hold_untold, "ENABLED, held by"),
    ("other_arm_stands", move_other_arm, "psm2 moved, psm1 acts"),
]


def said(log: MotionLog, check: str) -> str:
    return "\n".join(finding.text for finding in CHECKS[check](log))


@pytest.mark.parametrize(("check", "forge", "text"), FORGERIES)
def test_a_forged_log_is_told(
    logs: dict[str, MotionLog], check: str, forge: Forgery, text: str
) -> None:
    log = copy.deepcopy(logs["soft"])
    lifted = [row for row, phase in enumerate(phases(log)) if phase == "lift"]
    forge(log, lifted[len(lifted) // 2])
    assert text in said(log, check)


@pytest.mark.parametrize(
    ("shift", "text"),
    [
        ("late", "no rest within two ticks"),
        ("far", "goes too far"),
        ("faster", "speeds up"),
        ("aside", "leaves its path"),
        ("long", "retreat is too long"),
    ],
)
def test_a_forged_halt_is_told(logs: dict[str, MotionLog], shift: str, text: str) -> None:
    """The stop and the retreat of the crossing, had they gone otherwise."""
    log = copy.deepcopy(logs["soft"])
    names = phases(log)
    stop = names.index("stop")
    retreat = names.index("retreat")
    sent = [state["arms"][ARM]["setpoint_joints"] for state in log.states]
    if shift == "late":
        for row in range(stop, stop + 3):
            log.states[row]["action"]["phase"] = "stop"
    elif shift == "far":
        sent[stop][2] += 2e-3
    elif shift == "faster":
        sent[stop][2] = sent[stop - 1][2] + 2 * (sent[stop - 1][2] - sent[stop - 2][2])
    elif shift == "aside":
        sent[retreat][0] += 1e-4
    else:
        log.limits["retreat_max_m"] = 1e-5
    assert text in said(log, "halts_come_to_rest")
