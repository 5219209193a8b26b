"""What a log says of motion, held against the published arm and the tick protocol.

Reads by `motion_log`, computes by `benchmarks.psm_reference`, and imports nothing of motion. Each
check returns what it found wrong; `CHECKS` has them by name.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from benchmarks import psm_reference as psm
from numpy.typing import NDArray

from support.motion_log import Floats, MotionLog, phases, series

ARMS = tuple(psm.BASES)
HALTS = {"stop", "retreat", "held", "interrupted"}
STOP_TICKS = 2
# Two chains of six rotations of numbers below 1, in double precision; measured: 3e-16.
SAME = 1e-12
# Of limits that are used fully: differences of numbers near 0.1 over 20 ms.
ROUNDING = 1.0 + 1e-6
# The servos follow in joint space, where the mean of two points of a line lies beside it.
MEASURED = 1.0 + 1e-3
# The jaw's stop is no field of the scenario.
JAW_STOP_RAD_S2 = 50.0


class Finding(NamedTuple):
    """Something that should not be in a log."""

    tick: int
    text: str


def _where(log: MotionLog, wrong: NDArray[np.bool_], text: str, later: int = 0) -> list[Finding]:
    """Name the ticks at which a row holds; rows of n-th differences begin n ticks later."""
    ticks = log.ticks
    rows = np.flatnonzero(wrong.reshape(len(wrong), -1).any(axis=1))
    return [Finding(ticks[int(row) + later]["tick"], text) for row in rows]


def ticks_without_gaps(log: MotionLog) -> list[Finding]:
    """From tick 0 on, each tick once; further states of a tick have the arms where they were."""
    found: list[Finding] = []
    if log.states[0]["tick"] != 0:
        found.append(Finding(log.states[0]["tick"], "the first state is not that of tick 0"))
    for before, state in pairwise(log.states):
        step = state["tick"] - before["tick"]
        if step not in (0, 1):
            found.append(Finding(state["tick"], f"{step} ticks after the state before"))
        elif step == 0 and _places(state) != _places(before):
            found.append(Finding(state["tick"], "the arms moved without a tick"))
    return found


def _places(state: dict[str, Any]) -> Any:
    return {
        arm: {name: value for name, value in fields.items() if name != "operating_state"}
        for arm, fields in state["arms"].items()
    }


def tips_by_forward_kinematics(log: MotionLog) -> list[Finding]:
    """`tip_in_world` is where the measured joints bring the tip."""
    found: list[Finding] = []
    for arm in ARMS:
        poses = [state["arms"][arm]["tip_in_world"] for state in log.ticks]
        tips, rotations = psm.forward(series(log, arm, "joints"), psm.BASES[arm])
        told_m = np.array([pose["position_m"] for pose in poses])
        told = psm.rotations_of(np.array([pose["quaternion_xyzw"] for pose in poses]))
        found += _where(log, np.abs(told_m - tips) > SAME, f"{arm}: the tip is elsewhere")
        found += _where(log, np.abs(told - rotations) > SAME, f"{arm}: the tip is turned otherwise")
    return found


def joints_within_limits(log: MotionLog) -> list[Finding]:
    """Joints and jaws, measured and sent, are inside their ranges."""
    found: list[Finding] = []
    for arm in ARMS:
        for field in ("joints", "setpoint_joints"):
            values = series(log, arm, field)
            outside = (values < psm.LOWER) | (values > psm.UPPER)
            for joint in np.flatnonzero(outside.any(axis=0)):
                text = f"{arm}: {field} of {psm.NAMES[joint]} beyond its range"
                found += _where(log, outside[:, joint], text)
        for field in ("jaw_rad", "setpoint_jaw_rad"):
            jaw = series(log, arm, field)
            outside = (jaw < psm.JAW_RAD[0]) | (jaw > psm.JAW_RAD[1])
            found += _where(log, outside, f"{arm}: {field} beyond its range")
    return found


def rates_within_limits(log: MotionLog) -> list[Finding]:
    """Joints and jaws at their speeds always, at their accelerations where motion was planned."""
    found: list[Finding] = []
    planned = _planned(log)
    for arm in ARMS:
        joints, jaw = series(log, arm, "setpoint_joints"), series(log, arm, "setpoint_jaw_rad")
        measured = series(log, arm, "joints")
        told = series(log, arm, "joint_velocities")[1:]
        speeds, accelerations = _rate(log, joints, 1), _rate(log, joints, 2)
        found += _where(log, np.abs(speeds) > psm.SPEED * ROUNDING, f"{arm}: joint too fast", 1)
        found += _where(
            log, np.abs(told) > psm.SPEED * ROUNDING, f"{arm}: joint measured too fast", 1
        )
        # Of differences of numbers up to 4.5 over 20 ms.
        unlike = np.abs(told - _rate(log, measured, 1)) > 1e-12
        found += _where(log, unlike, f"{arm}: joint_velocities are not the joints'", 1)
        harsh = np.abs(accelerations) > psm.ACCELERATION * ROUNDING
        found += _where(
            log, harsh & planned[:, None], f"{arm}: planned joint acceleration too large", 2
        )
        fast = np.abs(_rate(log, jaw, 1)) > log.limits["jaw_speed_rad_s"] * ROUNDING
        found += _where(log, fast, f"{arm}: jaw too fast", 1)
        limit = np.where(planned, psm.JAW_ACCELERATION, JAW_STOP_RAD_S2) * ROUNDING
        harsh = np.abs(_rate(log, jaw, 2)) > limit
        found += _where(log, harsh, f"{arm}: jaw acceleration too large", 2)
    return found


def tips_within_limits(log: MotionLog) -> list[Finding]:
    """Tips keep the scenario's speed, acceleration and jerk, and the tool its orientation."""
    found: list[Finding] = []
    limits, planned = log.limits, _planned(log)
    holding = [
        state["action"] is not None and state["action"]["name"] in ("pull", "move")
        for state in log.ticks
    ]
    speed = np.where(holding, limits["holding_speed_m_s"], limits["free_speed_m_s"])[1:]
    # A jerk spans three ticks; the second of both windows is the same.
    unhurried = planned[1:] & planned[:-1]
    for arm in ARMS:
        tips, rotations = psm.forward(series(log, arm, "setpoint_joints"), psm.BASES[arm])
        told = np.array([state["arms"][arm]["tip_in_world"]["position_m"] for state in log.ticks])
        for places, name, share in ((tips, "sent", ROUNDING), (told, "measured", MEASURED)):
            fast = _length(_rate(log, places, 1)) > speed * share
            found += _where(log, fast, f"{arm}: tip too fast, as {name}", 1)
        accelerations = _length(_rate(log, tips, 2))
        limit = np.where(planned, limits["acceleration_m_s2"], limits["stop_deceleration_m_s2"])
        found += _where(log, accelerations > limit * ROUNDING, f"{arm}: tip accelerates", 2)
        jerks = _length(_rate(log, tips, 3)) * unhurried
        found += _where(log, jerks > limits["jerk_m_s3"] * ROUNDING, f"{arm}: tip jerks", 3)
        turned = psm.turns_rad(rotations, psm.tool_down(arm)) > 1e-6
        found += _where(log, turned, f"{arm}: the tool does not point down")
    return found


def _rate(log: MotionLog, values: Floats, order: int) -> Floats:
    return np.diff(values, order, axis=0) / log.dt_s**order


def _length(vectors: Floats) -> Floats:
    return np.linalg.norm(vectors, axis=1)


def _planned(log: MotionLog) -> NDArray[np.bool_]:
    """Whether both ticks of each second difference are planned ones, not those of a halt."""
    halts = np.array([phase in HALTS for phase in phases(log)])
    return ~(halts[1:-1] | halts[2:])


def moved_on_a_verdict(log: MotionLog) -> list[Finding]:
    """Each tick has the verdict on the one before it, and does what that verdict allows."""
    found: list[Finding] = []
    # The first on each tick: a state that is said again is judged again.
    verdicts = {verdict["tick"]: verdict for verdict in reversed(log.verdicts)}
    for before, state in pairwise(log.ticks):
        tick, on = state["tick"], state["verdict_tick"]
        if on != tick - 1:
            found.append(Finding(tick, f"moved on the verdict of tick {on}"))
        verdict = verdicts.get(tick - 1)
        if verdict is None:
            found.append(Finding(tick, "moved without a verdict on the tick before"))
            continue
        if verdict["stamp_ns"] > state["stamp_ns"]:
            found.append(Finding(tick, "moved before its verdict was there"))
        action = state["action"]
        if action is None:
            found.append(Finding(tick, "a tick without an action"))
            continue
        level, phase = verdict["level"], action["phase"]
        if phase not in HALTS and not _may_go_on(level, action["name"]):
            found.append(Finding(tick, f"{action['name']} went on ({phase}) at level {level}"))
        last = before["action"]
        if (
            last is not None
            and last["goal_id"] == action["goal_id"]
            and last["phase"] in HALTS
            and phase not in HALTS
        ):
            found.append(Finding(tick, f"{action['name']} went on ({phase}) after a halt"))
    return found


def _may_go_on(level: str, action: str) -> bool:
    """The tick protocol's table: soft binds a pull, hard and invalid all but a release."""
    if level == "ok" or action == "release":
        return True
    return level == "soft" and action != "pull"


def halts_come_to_rest(log: MotionLog) -> list[Finding]:
    """A stop slows down, rests within two ticks and goes no further than it needs.

    Its speed is known from its last planned tick: at most the mean over it, and what the planned
    acceleration adds in half a tick.
    """
    found: list[Finding] = []
    limits, names = log.limits, np.array(phases(log))
    for arm in ARMS:
        tips, _ = psm.forward(series(log, arm, "setpoint_joints"), psm.BASES[arm])
        steps = np.concatenate([[0.0], _length(np.diff(tips, axis=0))])
        for begin, end in _stops(log):
            moving = [row for row in range(begin, end) if steps[row] > SAME]
            if len(moving) > STOP_TICKS:
                found.append(Finding(log.ticks[begin]["tick"], f"{arm}: no rest within two ticks"))
            if any(steps[row] > steps[row - 1] + SAME for row in range(begin, end)):
                found.append(Finding(log.ticks[begin]["tick"], f"{arm}: a stop speeds up"))
            speed = steps[begin - 1] / log.dt_s + limits["acceleration_m_s2"] * log.dt_s / 2
            furthest = speed**2 / (2 * limits["stop_deceleration_m_s2"])
            if float(steps[begin:end].sum()) > furthest * ROUNDING:
                found.append(Finding(log.ticks[begin]["tick"], f"{arm}: a stop goes too far"))
        found += _retreats(log, arm, tips, names == "retreat")
    return found


def _stops(log: MotionLog) -> list[tuple[int, int]]:
    """Rows from the first of a halt to its retreat, or to the end of its action."""
    ticks, names = log.ticks, phases(log)
    found: list[tuple[int, int]] = []
    begin: int | None = None
    for row in range(1, len(ticks)):
        braking = names[row] in HALTS - {"retreat"}
        fresh = braking and (
            names[row - 1] not in HALTS
            or ticks[row]["action"]["goal_id"] != ticks[row - 1]["action"]["goal_id"]
        )
        if begin is not None and (fresh or not braking):
            found.append((begin, row))
            begin = None
        if fresh:
            begin = row
    if begin is not None:
        found.append((begin, len(ticks)))
    return found


def _retreats(log: MotionLog, arm: str, tips: Floats, back: NDArray[np.bool_]) -> list[Finding]:
    """A retreat goes back where the action came from, at most so far."""
    found: list[Finding] = []
    ticks = log.ticks
    for begin in np.flatnonzero(back & ~np.roll(back, 1)):
        goal = ticks[begin]["action"]["goal_id"]
        rows = [
            row
            for row in range(1, len(ticks))
            if (ticks[row]["action"] or {}).get("goal_id") == goal
        ]
        way = tips[rows[0] - 1 : begin]
        returned = tips[begin : rows[-1] + 1]
        off = max(_distance_to_path(place, way) for place in returned)
        if off > 1e-6:
            found.append(Finding(ticks[begin]["tick"], f"{arm}: a retreat leaves its path"))
        length = float(_length(np.diff(tips[begin - 1 : rows[-1] + 1], axis=0)).sum())
        if length > log.limits["retreat_max_m"] * ROUNDING:
            found.append(Finding(ticks[begin]["tick"], f"{arm}: a retreat is too long"))
    return found


def _distance_to_path(place: Floats, path: Floats) -> float:
    start, way = path[:-1], np.diff(path, axis=0)
    square = (way**2).sum(axis=1)
    share = np.clip(((place - start) * way).sum(axis=1) / np.maximum(square, 1e-300), 0.0, 1.0)
    return float(_length(place - start - share[:, None] * way).min())


def no_motion_while_held(log: MotionLog) -> list[Finding]:
    """From the third tick of a hold on nothing moves, and the arms say that they are held."""
    found: list[Finding] = []
    held_since: int | None = None
    for before, state in pairwise(log.states):
        held = bool(before["holds"])
        if not held:
            held_since = None
        elif held_since is None:
            held_since = before["tick"]
        beyond = held_since is not None and state["tick"] > held_since + STOP_TICKS
        if beyond and _sent(state) != _sent(before):
            found.append(Finding(state["tick"], "moved while held"))
    for state in log.states:
        wanted = "PAUSED" if state["holds"] else "ENABLED"
        found += [
            Finding(state["tick"], f"{arm}: {fields['operating_state']}, held by {state['holds']}")
            for arm, fields in state["arms"].items()
            if fields["operating_state"] != wanted
        ]
    return found


def _sent(state: dict[str, Any]) -> Any:
    return {
        arm: (fields["setpoint_joints"], fields["setpoint_jaw_rad"])
        for arm, fields in state["arms"].items()
    }


def other_arm_stands(log: MotionLog) -> list[Finding]:
    """Only the arm of the action gets new setpoints."""
    found: list[Finding] = []
    for before, state in pairwise(log.states):
        acting = state["action"]["arm"] if state["action"] else ""
        for arm, sent in _sent(state).items():
            if arm != acting and sent != _sent(before)[arm]:
                found.append(Finding(state["tick"], f"{arm} moved, {acting or 'nobody'} acts"))
    return found


CHECKS: dict[str, Callable[[MotionLog], list[Finding]]] = {
    check.__name__: check
    for check in (
        ticks_without_gaps,
        tips_by_forward_kinematics,
        joints_within_limits,
        rates_within_limits,
        tips_within_limits,
        moved_on_a_verdict,
        halts_come_to_rest,
        no_motion_while_held,
        other_arm_stands,
    )
}


def audit(log: MotionLog) -> dict[str, list[Finding]]:
    """Return what each check found, if anything."""
    found = {name: check(log) for name, check in CHECKS.items()}
    return {name: findings for name, findings in found.items() if findings}
