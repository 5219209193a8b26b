"""Stops at random ticks: what they travel, and how soon they rest."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from benchmarks import psm_reference as psm
from benchmarks.motion_jobs import Motion, Recorder, calm
from numpy.typing import NDArray

from fras_motion.controller import MotionController
from fras_motion.parameters import MotionParameters
from fras_motion.states import ArmState

Floats = NDArray[np.float64]
Raw = dict[str, Any]

ACTIONS = 5  # of a sequence: reach, grasp, pull, move, release
STOPS_A_SEQUENCE = 5
AT_REST = ("rest", "settle", "done")


@dataclass(frozen=True)
class Stop:
    """One stop.

    Parameters
    ----------
    jaw : bool
        Whether the jaw moved, not the tip.
    ticks : int
        From the hold to rest.
    travelled : float
        Way from the hold to rest [m or rad].
    speed : float
        Upper bound of the speed at the hold [m/s or rad/s].
    steady : bool
        Whether it moved at a constant speed, so that `speed` is exact.
    """

    jaw: bool
    ticks: int
    travelled: float
    speed: float
    steady: bool


def measure_stops(count: int, seed: int, tell: Callable[[int], None]) -> Raw:
    """Hold at random ticks of random actions, each next to the same action without a hold."""
    rng = np.random.default_rng(seed)
    stops: list[Stop] = []
    while len(stops) < count:
        recorder = Recorder(int(rng.integers(1 << 32)))
        undisturbed = [recorder.motion() for _ in range(ACTIONS)]
        for _ in range(min(STOPS_A_SEQUENCE, count - len(stops))):
            number, tick = _moving_tick(undisturbed, rng)
            stops.append(stop_at(undisturbed, number, tick, recorder.parameters))
            tell(len(stops))
    return summary(stops, MotionParameters())


def _moving_tick(motions: list[Motion], rng: np.random.Generator) -> tuple[int, int]:
    moving = [
        (number, tick)
        for number, motion in enumerate(motions)
        for tick, phase in enumerate(motion.phases)
        if phase not in AT_REST
    ]
    return moving[int(rng.integers(len(moving)))]


def stop_at(motions: list[Motion], number: int, tick: int, parameters: MotionParameters) -> Stop:
    """Do the same actions again, up to a tick of one of them, and hold there."""
    controller = MotionController(parameters)
    for motion in motions[:number]:
        controller.execute(motion.goal)
        while controller.wants_tick:
            controller.advance(calm(controller))
    motion = motions[number]
    controller.execute(motion.goal)
    for _ in range(tick):
        controller.advance(calm(controller))
    arm = motion.goal.arm
    way = [_place(controller.snapshot.arms[arm], arm)]
    controller.hold("bench", "stop")
    while controller.wants_tick:
        controller.advance(calm(controller))
        way.append(_place(controller.snapshot.arms[arm], arm))
    jaw = motion.goal.name in ("grasp", "release")
    kind = slice(3, 4) if jaw else slice(0, 3)
    travelled = float(np.linalg.norm(np.diff(np.array(way)[:, kind], axis=0), axis=1).sum())
    speed, steady = _speed(motion, tick, jaw, parameters)
    return Stop(jaw, len(way) - 1, travelled, speed, steady)


def _place(arm: ArmState, name: str) -> Floats:
    tips, _ = psm.forward(np.array([arm.setpoint_joints]), psm.BASES[name])
    return np.append(tips[0], arm.setpoint_jaw_rad)


def _speed(
    motion: Motion, tick: int, jaw: bool, parameters: MotionParameters
) -> tuple[float, bool]:
    """Speed at a tick of the undisturbed action: at most this, exactly this if it is steady.

    The central difference is off by at most jerk dt^2 / 6; the jaw's, which has no jerk limit,
    by acceleration dt / 2.
    """
    dt = parameters.dt_s
    around = slice(tick - 1, tick + 2)
    if jaw:
        places = motion.jaw_rad[around, None]
        error = psm.JAW_ACCELERATION * dt / 2
    else:
        places, _ = psm.forward(motion.joints[around], psm.BASES[motion.goal.arm])
        error = parameters.jerk_m_s3 * dt**2 / 6
    steady = bool(np.abs(np.diff(places, 2, axis=0)).max() < 1e-12)
    mean = float(np.linalg.norm(places[2] - places[0])) / (2 * dt)
    return (mean if steady else mean + error), steady


def summary(stops: list[Stop], parameters: MotionParameters) -> Raw:
    """Fold stops; ways as shares of v^2 / (2 a), the shortest that the deceleration allows."""
    figures: Raw = {"stops": len(stops), "most_ticks": max(stop.ticks for stop in stops)}
    for name, jaw, deceleration in (
        ("tip", False, parameters.stop_deceleration_m_s2),
        ("jaw", True, parameters.jaw_stop_deceleration_rad_s2),
    ):
        rows = [stop for stop in stops if stop.jaw == jaw]
        shares = [2 * deceleration * s.travelled / s.speed**2 for s in rows if s.speed > 0]
        steady = [
            2 * deceleration * s.travelled / s.speed**2 for s in rows if s.steady and s.speed > 0
        ]
        figures[name] = {
            "stops": len(rows),
            "furthest": max((stop.travelled for stop in rows), default=0.0),
            "largest_share": max(shares, default=0.0),
            "steady": len(steady),
            "steady_share": [min(steady, default=0.0), max(steady, default=0.0)],
        }
    return figures
