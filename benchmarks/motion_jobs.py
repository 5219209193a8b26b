"""Random actions for `benchmarks.motion`, and what their setpoints use of each limit.

Everything is computed from the setpoints by `benchmarks.psm_reference`, not by motion's own
kinematics.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np
from benchmarks import psm_reference as psm
from numpy.typing import NDArray

from fras_motion.controller import MotionController
from fras_motion.errors import Refused
from fras_motion.parameters import MotionParameters
from fras_motion.states import Goal, Verdict

Floats = NDArray[np.float64]
Raw = dict[str, Any]

ARMS = tuple(psm.BASES)
# Of the targets: over the tissue and past its edges, as far as the workspace goes; low enough for
# the clearance of a reach and the lift of a pull to stay in it.
TARGET_LOWER_M = (-0.01, -0.01, -0.005)
TARGET_UPPER_M = (0.11, 0.13, 0.035)
# A target may be refused for what is there already, such as the other instrument.
MOST_REFUSALS = 200
REDRAWS = 20


@dataclass(frozen=True)
class Motion:
    """One action that succeeded.

    Parameters
    ----------
    goal : Goal
        What was asked for.
    joints : ndarray, shape (n, 6)
        Setpoints of its arm, one a tick, from the one before it.
    jaw_rad : ndarray, shape (n,)
        The jaw's.
    phases : tuple of str, length n
        What it did in the tick that led there; the first is "rest".
    grasp_height_m : float
        Height at which this arm's jaw closed last; what a pull lifts above.
    """

    goal: Goal
    joints: Floats
    jaw_rad: Floats
    phases: tuple[str, ...]
    grasp_height_m: float


def draw_target(rng: np.random.Generator) -> tuple[float, float, float]:
    x, y, z = rng.uniform(TARGET_LOWER_M, TARGET_UPPER_M).tolist()
    return (x, y, z)


def random_goals(rng: np.random.Generator) -> Iterator[Goal]:
    """Reach, grasp, pull, move, release, again and again, with an arm drawn anew each time."""
    number = 0
    while True:
        arm = ARMS[int(rng.integers(len(ARMS)))]
        for name in ("reach", "grasp", "pull", "move", "release"):
            target = draw_target(rng) if name in ("reach", "move") else None
            yield Goal(f"{number}", name, arm, None, target)
            number += 1


def accept(
    controller: MotionController, goals: Iterator[Goal], rng: np.random.Generator
) -> tuple[Goal, int]:
    """Execute the next goal; a target that is refused is drawn again.

    What is refused for good, for instance a pull where the other instrument is above, is left out.
    Returns the goal that was accepted, and how many were refused before it.
    """
    goal = next(goals)
    for refusals in range(MOST_REFUSALS):
        try:
            controller.execute(goal)
        except Refused:
            again = goal.target_m is not None and refusals % REDRAWS != REDRAWS - 1
            goal = replace(goal, target_m=draw_target(rng)) if again else next(goals)
        else:
            return goal, refusals
    raise SystemExit(f"{MOST_REFUSALS} goals in a row were refused")


def calm(controller: MotionController) -> Verdict:
    """All is well, and each jaw holds tissue."""
    return Verdict(controller.snapshot.tick, grasped=dict.fromkeys(ARMS, 4))


class Recorder:
    """Turns a controller with ideal drivers, notes its setpoints and what each call takes."""

    def __init__(self, seed: int) -> None:
        self.parameters = MotionParameters(driver_time_constant_s=0.0)
        self.controller = MotionController(self.parameters)
        self.rng = np.random.default_rng(seed)
        self.tick_s: list[float] = []
        self.accept_s: list[float] = []
        self.refused = 0
        self._goals = random_goals(self.rng)
        self._grasp_heights: dict[str, float] = dict.fromkeys(ARMS, 0.0)

    def motion(self) -> Motion:
        """Do the next action to its end."""
        began_s = perf_counter()
        goal, refused = accept(self.controller, self._goals, self.rng)
        if not refused:
            self.accept_s.append(perf_counter() - began_s)
        self.refused += refused
        before = self.controller.snapshot.arms[goal.arm]
        joints, jaw, phases = [before.setpoint_joints], [before.setpoint_jaw_rad], ["rest"]
        result = None
        while result is None:
            verdict = calm(self.controller)
            began_s = perf_counter()
            advance = self.controller.advance(verdict)
            self.tick_s.append(perf_counter() - began_s)
            arm, action, result = (
                advance.snapshot.arms[goal.arm],
                advance.snapshot.action,
                advance.result,
            )
            joints.append(arm.setpoint_joints)
            jaw.append(arm.setpoint_jaw_rad)
            phases.append(action.phase if action is not None else "")
        if result.outcome != "succeeded":
            raise SystemExit(f"{goal} ended {result.outcome}: {result.reason}")
        if goal.name == "grasp":
            positions, _ = psm.forward(np.array(joints[:1]), psm.BASES[goal.arm])
            self._grasp_heights[goal.arm] = float(positions[0, 2])
        return Motion(
            goal,
            np.array(joints),
            np.array(jaw),
            tuple(phases),
            self._grasp_heights[goal.arm],
        )


def used_limits(motion: Motion, parameters: MotionParameters) -> dict[str, float]:
    """Largest use of each limit in a motion, as a share of it; 1 is the limit itself.

    A joint's position uses its range from the middle to a limit. Rates are differences of the
    setpoints, which are means of the continuous motion's and so never above its limits.
    """
    dt = parameters.dt_s
    joints = _at_rest(motion.joints)
    jaw = _at_rest(motion.jaw_rad[:, None])
    tips, _ = psm.forward(joints, psm.BASES[motion.goal.arm])
    middle, half = (psm.UPPER + psm.LOWER) / 2, (psm.UPPER - psm.LOWER) / 2
    jaw_middle, jaw_half = sum(psm.JAW_RAD) / 2, (psm.JAW_RAD[1] - psm.JAW_RAD[0]) / 2
    holds = motion.goal.name in ("pull", "move")
    speed = parameters.holding_speed_m_s if holds else parameters.free_speed_m_s

    def rate(values: Floats, order: int) -> Floats:
        return np.diff(values, order, axis=0) / dt**order

    def largest(values: Floats) -> float:
        return float(np.abs(values).max())

    def fastest(order: int) -> float:
        return float(np.linalg.norm(rate(tips, order), axis=1).max())

    return {
        "joint position": largest((joints - middle) / half),
        "joint speed": largest(rate(joints, 1) / psm.SPEED),
        "joint acceleration": largest(rate(joints, 2) / psm.ACCELERATION),
        "jaw position": largest((jaw - jaw_middle) / jaw_half),
        "jaw speed": largest(rate(jaw, 1)) / parameters.jaw_speed_rad_s,
        "jaw acceleration": largest(rate(jaw, 2)) / psm.JAW_ACCELERATION,
        "tip speed": fastest(1) / speed,
        "tip acceleration": fastest(2) / parameters.acceleration_m_s2,
        "tip jerk": fastest(3) / parameters.jerk_m_s3,
    }


def _at_rest(values: Floats) -> Floats:
    """Add the rest before and after, so that the first and last ticks count in all orders."""
    return np.concatenate([values[:1]] * 3 + [values] + [values[-1:]] * 3)


def strayed(motion: Motion, parameters: MotionParameters) -> tuple[float, float, float]:
    """How far a motion was from what was asked for.

    Returns
    -------
    off_line_m : float
        Largest distance of the tip from the straight lines between the corners.
    turned_rad : float
        Largest angle between the tool and straight down.
    off_target_m : float
        Distance of the last tip from the last corner.
    """
    tips, rotations = psm.forward(motion.joints, psm.BASES[motion.goal.arm])
    corners = expected_corners(motion, tips[0], parameters)
    off_line, here = 0.0, tips[0]
    phases = np.array(motion.phases)
    for phase, corner in corners.items():
        on_it = tips[phases == phase]
        if len(on_it):
            off_line = max(off_line, float(distances_m(on_it, here, corner).max()))
        here = corner
    turned = float(psm.turns_rad(rotations, psm.tool_down(motion.goal.arm)).max())
    return off_line, turned, float(np.linalg.norm(tips[-1] - here))


def distances_m(points: Floats, start: Floats, end: Floats) -> Floats:
    """Distance of points from the segment between two others."""
    way = end - start
    length = float(way @ way)
    share = np.clip((points - start) @ way / length, 0.0, 1.0) if length > 0 else 0.0
    return np.linalg.norm(points - start - np.multiply.outer(share, way), axis=-1)


def expected_corners(
    motion: Motion, start: Floats, parameters: MotionParameters
) -> dict[str, Floats]:
    """Where each phase of an action should end, from the goal and the start alone."""
    goal = motion.goal
    x, y, z = start.tolist()
    if goal.name == "pull":
        return {"lift": np.array([x, y, motion.grasp_height_m + parameters.lift_height_m])}
    if goal.target_m is None:
        return {}
    tx, ty, tz = goal.target_m
    if goal.name == "move":
        return {"carry": np.array([tx, ty, z])}
    above = max(z, tz + parameters.clearance_height_m)
    return {
        "rise": np.array([x, y, above]),
        "traverse": np.array([tx, ty, above]),
        "descend": np.array([tx, ty, tz]),
    }
