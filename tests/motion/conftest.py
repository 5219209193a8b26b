"""What the tests of motion share: an ideal controller, and a hand that turns it."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from fras_motion.controller import MotionController
from fras_motion.parameters import MotionParameters
from fras_motion.states import Advance, Goal, Snapshot, Verdict

Judge = Callable[[Snapshot, int], Verdict]


def calm(snapshot: Snapshot, number: int) -> Verdict:
    """Judge that all is well and each arm has tissue in its jaw."""
    del number
    return Verdict(snapshot.tick, grasped={"psm1": 4, "psm2": 4})


def turn(
    controller: MotionController, goal: Goal | None = None, judge: Judge = calm, limit: int = 3000
) -> list[Advance]:
    """Execute a goal and tick while the controller wants to; `judge` gets the ticks so far."""
    if goal is not None:
        controller.execute(goal)
    done: list[Advance] = []
    while controller.wants_tick:
        assert len(done) < limit, "never comes to an end"
        done.append(controller.advance(judge(controller.snapshot, len(done))))
    return done


@pytest.fixture
def ideal() -> MotionController:
    return MotionController(MotionParameters(driver_time_constant_s=0.0))


@pytest.fixture
def run() -> Callable[..., list[Advance]]:
    return turn


@pytest.fixture
def from_tick() -> Callable[..., Judge]:
    """Make a judge that is calm up to a tick and then says something else."""

    def make(number: int, **verdict: object) -> Judge:
        def judge(snapshot: Snapshot, ticks: int) -> Verdict:
            well = calm(snapshot, ticks)
            return replace(well, **verdict) if ticks >= number else well

        return judge

    return make


@pytest.fixture
def holding(ideal: MotionController) -> MotionController:
    """A controller whose psm1 has just grasped."""
    turn(ideal, Goal("r", "reach", "psm1", "b(2,2)", (0.02, 0.03, 0.005)))
    turn(ideal, Goal("g", "grasp", "psm1", "b(2,2)"))
    return ideal
