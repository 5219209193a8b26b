"""The audit finds arms that moved in a supervised trial while nobody looked at a page."""

import msgspec
import pytest

from fras_audit.recorded import Recorded, gather
from fras_audit.supervision import audit_supervision
from fras_common.codec import encode
from fras_common.messages import ArmState, Pose, Presence, RobotState
from fras_common.scenario import RunSection, Scenario
from fras_common.topics import PRESENCE, ROBOT_STATE
from fras_log import RawMessage

SECOND_NS = 1_000_000_000
POSE = Pose(position_m=(0.0, 0.0, 0.0), quaternion_xyzw=(0.0, 0.0, 0.0, 1.0))
STILL = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def state(tick: int, at_s: float, held: bool = False) -> RawMessage:
    """Arms that move with each tick."""
    arm = ArmState(
        joints=STILL,
        joint_velocities=STILL,
        tip_in_world=POSE,
        jaw_rad=0.0,
        setpoint_joints=(0.001 * tick, 0.0, 0.0, 0.0, 0.0, 0.0),
        setpoint_jaw_rad=0.0,
        operating_state="ENABLED",
    )
    said = RobotState(
        tick=tick,
        seq=tick,
        stamp_ns=int(at_s * SECOND_NS),
        trial="t",
        source="motion/1",
        arms={"psm1": arm},
        action=None,
        holds={"monitor:page": "nobody looks at a page"} if held else {},
        verdict_tick=tick - 1,
    )
    return RawMessage(ROBOT_STATE.key, encode(said), 0)


def presence(at_s: float, viewers: int = 1) -> RawMessage:
    said = Presence(viewers=viewers, stamp_ns=int(at_s * SECOND_NS), source="monitor/1")
    return RawMessage(PRESENCE.key, encode(said), 0)


def recorded(*messages: RawMessage, supervised: bool = True) -> Recorded:
    scenario = Scenario(run=msgspec.structs.replace(RunSection(), supervised=supervised))
    return gather(messages, Recorded("", "t", {}, scenario))


def different(*messages: RawMessage) -> tuple[int, str]:
    """How many states are not as they should be, and the first of them."""
    (tally,) = audit_supervision(recorded(*messages))
    return tally.differences, tally.first.where if tally.first is not None else ""


RIGHT = (0, "")
MOVING = tuple(state(tick, 10 + tick) for tick in range(6))


def test_motion_under_somebodys_eyes_is_right() -> None:
    assert different(*MOVING, *(presence(9 + 0.5 * n) for n in range(14))) == RIGHT


@pytest.mark.parametrize("viewers", [None, 0])
def test_motion_that_nobody_watched_is_found(viewers: int | None) -> None:
    words = () if viewers is None else tuple(presence(9 + n, viewers) for n in range(8))
    assert different(*MOVING, *words) == (5, "tick 1")


def test_motion_after_the_page_was_lost_is_found() -> None:
    words = [presence(9.0), presence(10.0), presence(11.0)]
    assert different(*MOVING, *words) == (2, "tick 4")


def test_arms_that_stop_for_want_of_a_page_may_move_until_they_stand() -> None:
    assert different(state(0, 10, held=True), state(1, 10.02, held=True)) == RIGHT


def test_of_a_trial_that_needed_no_eyes_nothing_is_said() -> None:
    assert audit_supervision(recorded(*MOVING, supervised=False)) == []
