"""What motion's parts take: inverse kinematics beside its peer, and ticks against a wall clock."""

from collections.abc import Callable
from time import perf_counter, sleep, thread_time
from typing import Any

import numpy as np
from benchmarks import psm_reference as psm
from benchmarks.motion_jobs import ARMS, Motion, accept, calm, random_goals
from benchmarks.motion_peer import DampedLeastSquares, targets
from numpy.typing import NDArray

from fras_motion.controller import MotionController
from fras_motion.kinematics import BASES_IN_WORLD, ArmKinematics, Joints, Pose
from fras_motion.parameters import MotionParameters

Floats = NDArray[np.float64]
Raw = dict[str, Any]


def spread_us(spent_s: list[float]) -> Raw:
    """Percentiles of durations [us]."""
    p50, p99 = np.percentile(spent_s, [50, 99])
    return {
        "p50_us": round(float(p50) * 1e6, 2),
        "p99_us": round(float(p99) * 1e6, 2),
        "max_us": round(max(spent_s) * 1e6, 2),
    }


def inverse_kinematics(motions: list[Motion], most_ticks: int) -> Raw:
    """Both arms' inverse kinematics along what they did, ours and the peer's, in turns.

    Each tick inverts one tip of either arm, as a tick in which both move would; both ways begin
    at their own joints of the tick before.
    """
    paths = {arm: _moving_joints(motions, arm) for arm in ARMS}
    ticks = min(most_ticks, *(len(path) for path in paths.values()))
    tips = {arm: psm.forward(path[:ticks], psm.BASES[arm])[0] for arm, path in paths.items()}
    ours, ours_s = _run_ours(tips, paths, ticks)
    peers, peers_s, iterations = _run_peer(tips, paths, ticks)
    return {
        "ticks": ticks,
        "ours": spread_us(ours_s) | _accuracy(ours, tips),
        "peer": spread_us(peers_s)
        | _accuracy(peers, tips)
        | {"iterations": round(float(np.mean(iterations)), 2)},
        "ratio_p50": round(float(np.median(peers_s) / np.median(ours_s)), 1),
        "ratio_p99": round(float(np.percentile(peers_s, 99) / np.percentile(ours_s, 99)), 1),
    }


def _moving_joints(motions: list[Motion], arm: str) -> Floats:
    """Setpoints of an arm along its lines, without its rests, one line after another."""
    rows = [m.joints for m in motions if m.goal.arm == arm]
    if not rows:
        raise SystemExit(f"{arm} never moved in {len(motions)} motions; ask for more")
    joints = np.concatenate(rows)
    moves = np.any(np.diff(joints, axis=0) != 0.0, axis=1)
    return joints[1:][moves]


def _run_ours(
    tips: dict[str, Floats], paths: dict[str, Floats], ticks: int
) -> tuple[dict[str, Floats], list[float]]:
    arms = {name: ArmKinematics(BASES_IN_WORLD[name]) for name in ARMS}
    poses = {
        name: [Pose((x, y, z), arm.tool_down_xyzw) for x, y, z in tips[name].tolist()]
        for name, arm in arms.items()
    }
    near: dict[str, Joints] = {name: _joints(paths[name][0]) for name in ARMS}
    found: dict[str, list[Joints]] = {name: [] for name in ARMS}
    spent: list[float] = []
    for tick in range(ticks):
        began_s = perf_counter()
        for name, arm in arms.items():
            near[name] = arm.inverse(poses[name][tick], near[name])
        spent.append(perf_counter() - began_s)
        for name in ARMS:
            found[name].append(near[name])
    return {name: np.array(rows) for name, rows in found.items()}, spent


def _run_peer(
    tips: dict[str, Floats], paths: dict[str, Floats], ticks: int
) -> tuple[dict[str, Floats], list[float], list[int]]:
    arms = {name: DampedLeastSquares(name) for name in ARMS}
    poses = {name: targets(tips[name], psm.tool_down(name)) for name in ARMS}
    near = {name: paths[name][0] for name in ARMS}
    found: dict[str, list[Floats]] = {name: [] for name in ARMS}
    spent: list[float] = []
    iterations: list[int] = []
    for tick in range(ticks):
        began_s = perf_counter()
        for name, arm in arms.items():
            joints = arm.solve(poses[name][tick], near[name])
            if joints is None:
                raise SystemExit(f"the peer does not converge at tick {tick} of {name}")
            near[name] = joints
        spent.append(perf_counter() - began_s)
        for name, arm in arms.items():
            found[name].append(near[name])
            iterations.append(arm.iterations)
    return {name: np.array(rows) for name, rows in found.items()}, spent, iterations


def _joints(row: Floats) -> Joints:
    a, b, c, d, e, f = row.tolist()
    return (a, b, c, d, e, f)


def _accuracy(found: dict[str, Floats], tips: dict[str, Floats]) -> Raw:
    """Largest distance and turn between what was asked for and what the joints give."""
    off_m, turned_rad = 0.0, 0.0
    for arm, joints in found.items():
        positions, rotations = psm.forward(joints, psm.BASES[arm])
        off_m = max(off_m, float(np.linalg.norm(positions - tips[arm], axis=1).max()))
        turned_rad = max(turned_rad, float(psm.turns_rad(rotations, psm.tool_down(arm)).max()))
    return {"off_m": off_m, "turned_rad": turned_rad}


def inverse_from_anywhere(count: int, seed: int) -> Raw:
    """Poses drawn over all joints' ranges, each from the joints of another such draw."""
    rng = np.random.default_rng(seed)
    joints = rng.uniform(psm.LOWER, psm.UPPER, (count, 6))
    arm, peer = ArmKinematics(BASES_IN_WORLD["psm1"]), DampedLeastSquares("psm1")
    positions, rotations = psm.forward(joints, psm.BASES["psm1"])
    off_m, turned_rad, solved_by_peer = 0.0, 0.0, 0
    for number in range(count):
        start = joints[number - 1]
        pose = arm.forward(_joints(joints[number]))
        found = np.array([arm.inverse(pose, _joints(start))])
        (position,), (rotation,) = psm.forward(found, psm.BASES["psm1"])
        off_m = max(off_m, float(np.linalg.norm(position - positions[number])))
        turned_rad = max(turned_rad, float(psm.turns_rad(rotation, rotations[number])))
        (target,) = targets(positions[number : number + 1], rotations[number])
        by_peer = peer.solve(target, start)
        solved_by_peer += by_peer is not None and bool(
            np.all((by_peer >= psm.LOWER) & (by_peer <= psm.UPPER))
        )
    return {
        "poses": count,
        "off_m": off_m,
        "turned_rad": turned_rad,
        "peer_within_limits": round(solved_by_peer / count, 4),
    }


def paced_ticks(ticks: int, pace: float, seed: int, tell: Callable[[int], None]) -> Raw:
    """Ticks of the controller against the wall clock, asleep until each is due.

    Each is late by what its setpoint was done after it was due (`perf_counter`); it counts as
    late when the next one was due by then. As with the service's pacer, a late tick puts the
    following ones off, and none catches up. What an action's acceptance takes is not part of it:
    logical time stands still until then. Of the late ones it tells how many the machine woke too
    late already, and what the ticks took of the processor (`thread_time`), however busy it is.
    """
    rng = np.random.default_rng(seed)
    controller, goals = MotionController(), random_goals(rng)
    period_s = MotionParameters().dt_s / pace
    lateness: list[float] = []
    worked_s: list[float] = []
    due_s, woken_late = 0.0, 0
    while len(lateness) < ticks:
        if not controller.wants_tick:
            accept(controller, goals, rng)
            due_s = perf_counter()
        sleep(max(0.0, due_s - perf_counter()))
        began_s = perf_counter()
        work_began_s = thread_time()
        controller.advance(calm(controller))
        worked_s.append(thread_time() - work_began_s)
        lateness.append(perf_counter() - due_s)
        woken_late += began_s - due_s > period_s
        due_s = max(due_s, began_s - period_s) + period_s
        tell(len(lateness))
    late = sum(one > period_s for one in lateness)
    return {
        "ticks": ticks,
        "pace": pace,
        "period_ms": period_s * 1e3,
        "late": late,
        "woken_late": woken_late,
        "late_in_10000": round(late * 1e4 / ticks, 2),
        "worked": spread_us(worked_s),
        **spread_us(lateness),
    }
