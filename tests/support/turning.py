"""A hand that turns a motion controller, tick by tick, with a verdict for each."""

from collections.abc import Callable

from fras_motion.controller import MotionController
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
