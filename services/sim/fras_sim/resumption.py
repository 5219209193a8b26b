"""What a simulator that starts again has to know, and the trial that it makes of that."""

import time
from dataclasses import dataclass

from fras_common.messages import ResetRequest, RobotState, SimCheckpoint, TissueState
from fras_common.service.recall import Asked, Last, Recalling, Since, reset_under_way
from fras_common.topics import ROBOT_STATE, TissueTopics
from fras_sim.trial import Step, TissueTrial

# Checkpoints come every ten ticks, so the last but one is not older.
LOOK_BACK_TICKS = 20


@dataclass(frozen=True)
class TakenUp:
    """The trial under way, where the simulator before this one was, and what is still to be said.

    Parameters
    ----------
    asked : Asked
        The reset that began it.
    trial : TissueTrial
    steps : list of Step
    """

    asked: Asked
    trial: TissueTrial
    steps: list[Step]


def new_trial(request: ResetRequest) -> TissueTrial:
    """Make the tissue of a reset, at rest; raises as `TissueTrial` does."""
    return TissueTrial(request.trial, request.scenario, request.mesh, time.perf_counter)


def take_up(topics: TissueTopics) -> Recalling:
    """Recall the trial under way; returns it as `TakenUp`, or None if there is none.

    Parameters
    ----------
    topics : TissueTopics
        Where the simulator speaks.
    """
    asked: Asked | None = yield from reset_under_way(topics.reset)
    if asked is None:
        return None
    name = asked.request.trial
    robot: RobotState | None = yield Last(ROBOT_STATE)
    since = max(0, robot.tick - LOOK_BACK_TICKS) if robot is not None else 0
    checkpoints: list[SimCheckpoint] = yield Since(topics.checkpoint, since)
    checkpoints = [one for one in checkpoints if one.trial == name]
    # Without one the tissue comes from rest.
    since = since if checkpoints else 0
    said: list[TissueState] = yield Since(topics.state, since)
    robots: list[RobotState] = yield Since(ROBOT_STATE, since)
    trial = new_trial(asked.request)
    steps = trial.resume(
        checkpoints,
        [one for one in said if one.trial == name],
        [one for one in robots if one.trial == name],
    )
    return TakenUp(asked, trial, steps)
