"""The shell of CRTK: what the arms publish, and the commands that reach them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from math import hypot
from typing import cast

from fras_common import messages as m
from fras_common.messages.crtk import State
from fras_common.messages.robot import Joints
from fras_common.service import ServiceHost
from fras_common.topics import CRTK, ArmTopics
from fras_motion.kinematics import ArmKinematics, Pose
from fras_motion.states import ArmState

from .direct import DirectControl
from .errors import CommandRefused

__all__ = ["FAST_PERIOD_S", "HEARTBEAT_S", "PERIOD_S", "CrtkFace"]

PERIOD_S = 0.01
"""The arms say no more often than this, on average, where they are."""
FAST_PERIOD_S = 0.1
"""Nor than this in a trial faster than life: nobody follows it, and `robot/state` has each tick."""
HEARTBEAT_S = 0.5
"""They say so at least this often, so that whoever comes later knows."""

_UNIT = 1e-6

Permit = Callable[[str, str, str], None]
"""Gets arm, command and sender; raises `CommandRefused` while that one may not lead the arms."""
OnState = Callable[[str, str], None]
"""Gets arm and state command."""


class CrtkFace:
    """The arms as a CRTK client sees them.

    Parameters
    ----------
    host : ServiceHost
    direct : DirectControl
        Who follows the commands.
    kinematics : mapping of str to ArmKinematics
        By arm, for the pose of a setpoint.
    permit : callable
        Called before each motion command.
    on_state : callable
        Called for each state command.
    """

    def __init__(
        self,
        host: ServiceHost,
        direct: DirectControl,
        kinematics: Mapping[str, ArmKinematics],
        permit: Permit,
        on_state: OnState,
    ) -> None:
        self._direct = direct
        self._permit = permit
        self._due_s = 0.0
        self._heartbeat_s = 0.0
        self._states: dict[str, tuple[str, bool, bool]] = {}
        self._arms = {
            keys.arm: _ArmPublishers(host, keys, kinematics[keys.arm])
            for keys in CRTK
            if keys.arm in kinematics
        }
        for keys in CRTK:
            arm = keys.arm
            host.subscribe(keys.state_command, partial(_state_command, on_state, arm))
            host.subscribe(keys.servo_jp, partial(self._servo_jp, arm))
            host.subscribe(keys.servo_cp, partial(self._servo_cp, arm))
            host.subscribe(keys.move_cp, partial(self._move_cp, arm))
            host.subscribe(keys.jaw_servo_jp, partial(self._servo_jaw, arm))

    def publish(
        self,
        arms: Mapping[str, ArmState],
        busy: Mapping[str, bool],
        tick: int,
        now_s: float,
        period_s: float = PERIOD_S,
    ) -> bool:
        """Say where the arms are, if it is time to; a change of state is always said.

        Parameters
        ----------
        arms : mapping of str to ArmState
        busy : mapping of str to bool
            Whether a motion with an end is under way.
        tick : int
            Of the trial, or -1.
        now_s : float
            Monotonic clock.
        period_s : float
            No more often than this is said where they are.

        Returns
        -------
        bool
            Whether it was said; else it was too early.
        """
        # Arms that tick at this very rate, a little late or early, would leave out every other time
        # if each were counted from the last; so there is a grid, and half a period of grace.
        grace_s = 0.5 * period_s
        early = now_s < self._due_s - grace_s
        heartbeat = now_s >= self._heartbeat_s and not early
        for name, arm in arms.items():
            status = self._direct.status(name)
            state = (arm.operating_state, status.is_homed, busy.get(name, False))
            if heartbeat or self._states.get(name) != state:
                self._states[name] = state
                self._arms[name].say_state(state, tick)
        if heartbeat:
            self._heartbeat_s = now_s + HEARTBEAT_S
        if early:
            return False
        missed = now_s >= self._due_s + grace_s
        self._due_s = (now_s if missed else self._due_s) + period_s
        for name, arm in arms.items():
            self._arms[name].say_where(arm, tick)
        return True

    def heartbeat_in_s(self, now_s: float) -> float:
        """Seconds until the arms must say again where they are."""
        return max(0.0, self._heartbeat_s - now_s, self._due_s - now_s)

    def due_in_s(self, now_s: float) -> float:
        """Seconds until the arms may say again where they are."""
        return max(0.0, self._due_s - now_s)

    def _servo_jp(self, arm: str, command: m.ServoJoints) -> None:
        self._permit(arm, "servo_jp", command.source)
        self._direct.servo_jp(arm, command.joints)

    def _servo_cp(self, arm: str, command: m.TipCommand) -> None:
        self._permit(arm, "servo_cp", command.source)
        self._direct.servo_cp(arm, _pose(arm, "servo_cp", command))

    def _move_cp(self, arm: str, command: m.TipCommand) -> None:
        self._permit(arm, "move_cp", command.source)
        self._direct.move_cp(arm, _pose(arm, "move_cp", command))

    def _servo_jaw(self, arm: str, command: m.ServoJaw) -> None:
        self._permit(arm, "jaw/servo_jp", command.source)
        self._direct.servo_jaw(arm, command.jaw_rad)


class _ArmPublishers:
    def __init__(self, host: ServiceHost, keys: ArmTopics, kinematics: ArmKinematics) -> None:
        self._kinematics = kinematics
        self._measured_js = host.publisher(keys.measured_js)
        self._measured_cp = host.publisher(keys.measured_cp)
        self._setpoint_js = host.publisher(keys.setpoint_js)
        self._setpoint_cp = host.publisher(keys.setpoint_cp)
        self._jaw_measured_js = host.publisher(keys.jaw_measured_js)
        self._jaw_setpoint_js = host.publisher(keys.jaw_setpoint_js)
        self._operating_state = host.publisher(keys.operating_state)

    def say_state(self, state: tuple[str, bool, bool], tick: int) -> None:
        name, is_homed, is_busy = state
        self._operating_state.put(
            m.OperatingState(tick=tick, state=cast(State, name), is_homed=is_homed, is_busy=is_busy)
        )

    def say_where(self, arm: ArmState, tick: int) -> None:
        # The jaw first: who waits for the joints has it then.
        self._jaw_measured_js.put(m.JawState(tick=tick, jaw_rad=arm.jaw_rad))
        self._jaw_setpoint_js.put(m.JawState(tick=tick, jaw_rad=arm.setpoint_jaw_rad))
        self._setpoint_js.put(_joints(tick, arm.setpoint_joints, (0.0,) * 6))
        setpoint_tip = self._kinematics.forward(arm.setpoint_joints)
        self._setpoint_cp.put(m.TipState(tick=tick, tip_in_world=_message(setpoint_tip)))
        self._measured_cp.put(m.TipState(tick=tick, tip_in_world=_message(arm.tip_in_world)))
        self._measured_js.put(_joints(tick, arm.joints, arm.joint_velocities))


def _state_command(on_state: OnState, arm: str, message: m.StateCommand) -> None:
    on_state(arm, message.command)


def _joints(tick: int, joints: tuple[float, ...], velocities: tuple[float, ...]) -> m.JointState:
    return m.JointState(
        tick=tick, joints=cast(Joints, joints), joint_velocities=cast(Joints, velocities)
    )


def _pose(arm: str, name: str, command: m.TipCommand) -> Pose:
    pose = command.tip_in_world
    length = hypot(*pose.quaternion_xyzw)
    if not abs(length - 1.0) <= _UNIT:
        text = f"the quaternion has the length {length:.6g}, not 1"
        raise CommandRefused(arm, name, "not_unit", text, length=length)
    return Pose(pose.position_m, pose.quaternion_xyzw)


def _message(pose: Pose) -> m.Pose:
    return m.Pose(position_m=pose.position_m, quaternion_xyzw=pose.quaternion_xyzw)
