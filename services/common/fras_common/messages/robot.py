"""What the robot's driver publishes each tick."""

from typing import Literal

from fras_common.messages.base import Header, Pose, Wire

Joints = tuple[float, float, float, float, float, float]


class ArmState(Wire, frozen=True, kw_only=True):
    """One PSM; joints are yaw, pitch, insertion [m], roll, wrist pitch, wrist yaw [rad].

    Attributes
    ----------
    grasp_height_m : float or None
        Height of the tip when the jaw closed; None while it is open.
    hard_latched : bool
        Whether the arm crossed the hard force limit and has not released since.
    """

    joints: Joints
    joint_velocities: Joints
    tip_in_world: Pose
    jaw_rad: float
    setpoint_joints: Joints
    setpoint_jaw_rad: float
    operating_state: Literal["DISABLED", "ENABLED", "PAUSED", "FAULT"]
    grasp_height_m: float | None = None
    hard_latched: bool = False


class ActionState(Wire, frozen=True, kw_only=True):
    """The action under way, or the one that this tick ended (phase done or interrupted)."""

    goal_id: str
    name: str
    arm: str
    block: str
    phase: str


class RobotState(Header, frozen=True, kw_only=True):
    """Both arms at one tick, and the verdict on which they moved there."""

    arms: dict[str, ArmState]
    action: ActionState | None
    holds: dict[str, str]
    verdict_tick: int
