"""What the tests of motion share: an ideal controller, and a hand that turns it."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from fras_motion.controller import MotionController
from fras_motion.parameters import MotionParameters
from fras_motion.states import Advance, Goal, Snapshot, Verdict
from support.turning import Judge, calm, turn


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
