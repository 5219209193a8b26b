"""A stop at any moment of any action: at rest within two ticks, on the shortest way."""

from dataclasses import dataclass
from itertools import pairwise
from math import dist

import pytest

from fras_motion.controller import MotionController
from fras_motion.kinematics import BASES_IN_WORLD
from fras_motion.parameters import MotionParameters
from fras_motion.states import Goal, Snapshot, Verdict
from support import campaign

PARAMETERS = MotionParameters(driver_time_constant_s=0.0)
DT = PARAMETERS.dt_s
PHASES = {
    "rise", "traverse", "descend", "close", "lift", "carry", "open", "settle", "stop", "retreat",
}  # fmt: skip


@dataclass(frozen=True)
class Pose:
    """Where the setpoint is: tip [m] and jaw [rad]."""

    tip_m: tuple[float, float, float]
    jaw_rad: float

    def way(self, other: "Pose") -> tuple[float, float]:
        return dist(self.tip_m, other.tip_m), abs(self.jaw_rad - other.jaw_rad)


def pose(snapshot: Snapshot, arm: str) -> Pose:
    state = snapshot.arms[arm]
    return Pose(state.tip_in_world.position_m, state.setpoint_jaw_rad)


def goals(arm: str) -> list[Goal]:
    """Every action, with both kinds of end of a pull."""
    return [
        Goal("0", "reach", arm, None, (0.02, 0.05, 0.005)),
        Goal("1", "reach", arm, None, (0.02, 0.06, 0.005)),
        Goal("2", "grasp", arm),
        Goal("3", "pull", arm),
        Goal("4", "move", arm, None, (0.06, 0.07, 0.0)),
        Goal("5", "pull", arm),
        Goal("6", "release", arm),
    ]


def judge(controller: MotionController, goal: Goal) -> Verdict:
    """A force that crosses the soft limit 20 mm up in the first pull."""
    snapshot = controller.snapshot
    height = pose(snapshot, goal.arm).tip_m[2] - 0.005
    force = 0.5 * height / 0.02 if goal.goal_id == "3" else 0.0
    return Verdict(
        snapshot.tick,
        "soft" if force > 0.5 else "ok",
        max_force_n=force,
        grasped={goal.arm: 4},
    )


def drive(controller: MotionController, arm: str, until: int) -> tuple[list[Snapshot], Goal | None]:
    """Play the actions up to a tick; the goal under way there, if one is."""
    snapshots = [controller.reset()]
    for goal in goals(arm):
        controller.execute(goal)
        while controller.wants_tick:
            if controller.snapshot.tick == until:
                return snapshots, goal
            snapshots.append(controller.advance(judge(controller, goal)).snapshot)
    return snapshots, None


@pytest.mark.parametrize(
    ("arm", "stride"), [("psm1", campaign.length(7, 16)), ("psm2", campaign.length(16, 37))]
)
def test_stop_in_any_phase_of_any_action(arm: str, stride: int) -> None:
    controller = MotionController(PARAMETERS, {arm: BASES_IN_WORLD[arm]})
    whole, _ = drive(controller, arm, -1)
    stopped_in: set[str] = set()
    phases = [state.action.phase if state.action else "" for state in whole]
    # A stop and a retreat last a few ticks only: each of them.
    moments = [
        tick
        for tick, phase in enumerate(phases[1:])
        if tick % stride == 0 or phase in ("stop", "retreat")
    ]
    for when in moments:
        before, goal = drive(controller, arm, when)
        assert goal is not None
        controller.hold("page", "stop")
        held = controller.snapshot
        ways = [pose(before[-1], arm)]
        while controller.wants_tick:
            ways.append(pose(controller.advance(judge(controller, goal)).snapshot, arm))
        phase = phases[when + 1]  # what the next tick would have done
        stopped_in.add(phase)

        assert controller.snapshot.tick - held.tick <= 2
        assert controller.snapshot.action is not None
        assert controller.snapshot.action.phase == "held"
        # Its speed at the hold: the mean of the last tick, and what half a tick may add to it.
        last = pose(before[-2], arm).way(ways[0]) if len(before) > 1 else (0.0, 0.0)
        speeding = PARAMETERS.stop_deceleration_m_s2 if phase == "retreat" else 0.2
        speed = last[0] / DT + 0.5 * speeding * DT
        jaw_speed = last[1] / DT + 0.5 * PARAMETERS.jaw_acceleration_rad_s2 * DT
        travelled = sum(a.way(b)[0] for a, b in pairwise(ways))
        turned = sum(a.way(b)[1] for a, b in pairwise(ways))
        assert travelled <= speed**2 / (2 * PARAMETERS.stop_deceleration_m_s2) + 1e-9, when
        assert turned <= jaw_speed**2 / (2 * PARAMETERS.jaw_stop_deceleration_rad_s2) + 1e-9, when
        controller.resume("page")
    assert stopped_in >= PHASES
