"""Robot states made by hand, for whoever listens to `robot/state`."""

from math import radians
from typing import Any

from fras_common.messages import ActionState, ArmState, Pose, RobotState, Vec3

REST = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def arm(tip_m: Vec3, jaw_deg: float) -> ArmState:
    return ArmState(
        joints=REST,
        joint_velocities=REST,
        tip_in_world=Pose(position_m=tip_m, quaternion_xyzw=(1.0, 0.0, 0.0, 0.0)),
        jaw_rad=radians(jaw_deg),
        setpoint_joints=REST,
        setpoint_jaw_rad=radians(jaw_deg),
        operating_state="ENABLED",
    )


def robot(
    tick: int,
    tip_m: Vec3 = (0.05, 0.03, 0.06),
    jaw_deg: float = 60.0,
    action: ActionState | None = None,
    **header: Any,
) -> RobotState:
    """Both arms; psm1 as given, psm2 away with its jaw open."""
    fields: dict[str, Any] = {"trial": "t", **header}
    return RobotState(
        tick=tick,
        arms={"psm1": arm(tip_m, jaw_deg), "psm2": arm((0.05, 0.09, 0.06), 60.0)},
        action=action,
        holds={},
        verdict_tick=tick - 1,
        **fields,
    )
