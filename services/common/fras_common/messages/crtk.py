"""What an arm says and is told under the keys of CRTK, the common robotics toolkit interface.

Joints are yaw, pitch, insertion [m], roll, wrist pitch, wrist yaw [rad]; poses are the tip's in the
world frame of the scenario. All numbers of a command must be finite.
"""

from typing import Literal

from fras_common.messages.base import Header, Pose, require_finite
from fras_common.messages.robot import Joints

State = Literal["DISABLED", "ENABLED", "PAUSED", "FAULT"]
Command = Literal["enable", "disable", "pause", "resume", "home", "unhome"]


class JointState(Header, frozen=True, kw_only=True):
    """Of `measured_js` and `setpoint_js`; velocities are zero where they are not known."""

    joints: Joints
    joint_velocities: Joints


class JawState(Header, frozen=True, kw_only=True):
    """Of `jaw/measured_js` and `jaw/setpoint_js`."""

    jaw_rad: float


class TipState(Header, frozen=True, kw_only=True):
    """Of `measured_cp` and `setpoint_cp`."""

    tip_in_world: Pose


class OperatingState(Header, frozen=True, kw_only=True):
    """Of `operating_state`.

    Attributes
    ----------
    is_homed : bool
        Whether the arm knows where it is; it moves only then.
    is_busy : bool
        Whether a motion with an end (`move_cp`, an action of a trial) is under way.
    """

    state: State
    is_homed: bool
    is_busy: bool


class StateCommand(Header, frozen=True, kw_only=True):
    """For `state_command`."""

    command: Command


class ServoJoints(Header, frozen=True, kw_only=True):
    """For `servo_jp`: where the joints shall be at once."""

    joints: Joints

    def __post_init__(self) -> None:
        require_finite("joints", *self.joints)


class ServoJaw(Header, frozen=True, kw_only=True):
    """For `jaw/servo_jp`: where the jaw shall be at once."""

    jaw_rad: float

    def __post_init__(self) -> None:
        require_finite("jaw_rad", self.jaw_rad)


class TipCommand(Header, frozen=True, kw_only=True):
    """For `servo_cp` (at once) and `move_cp` (along a straight line, from rest to rest)."""

    tip_in_world: Pose

    def __post_init__(self) -> None:
        pose = self.tip_in_world
        require_finite("tip_in_world.position_m", *pose.position_m)
        require_finite("tip_in_world.quaternion_xyzw", *pose.quaternion_xyzw)
