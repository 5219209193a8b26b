"""Arms that follow commands from outside, while no trial runs: pure, one tick at a time."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import dist

from fras_motion.course import Course
from fras_motion.drivers import Driver, Measured, Setpoint
from fras_motion.kinematics import JOINTS, ArmKinematics, Instrument, Joints, Pose, Unreachable
from fras_motion.parameters import MotionParameters
from fras_motion.rehearsal import rehearse
from fras_motion.safety import GATES, Gate, GateRefused, Step
from fras_motion.states import ArmState, Goal, Verdict
from fras_motion.trajectory import Limits, ProfileImpossible, rest_to_rest

from .errors import CommandRefused
from .line import TurningStroke, limits_along, path_length
from .state_machine import ArmStatus, follow

__all__ = ["DIRECT_GATES", "DirectControl"]

# An action on tissue keeps its tool's orientation; a hand that leads an arm may turn it.
DIRECT_GATES: dict[str, Gate] = {
    name: gate for name, gate in GATES.items() if name != "orientation"
}
# A step of a servo may be as long as the limits allow in the time since the last one, but no
# longer than in this time: what stood still may not leap.
_LONGEST_STEP_S = 0.05
_AT_POSE_M = 1e-9
_AT_REST = 1e-6
_CALM = Verdict(0)


@dataclass
class _Arm:
    kinematics: ArmKinematics
    driver: Driver
    status: ArmStatus
    setpoint: Setpoint
    measured: Measured
    wanted: Setpoint | None = None
    course: Course | None = None
    is_fresh: bool = False
    ticks_since_servo: int = 1000


class DirectControl:
    """Arms and their state machines.

    Parameters
    ----------
    parameters : MotionParameters
        The numbers of motion.
    kinematics : mapping of str to ArmKinematics
        By arm.
    gates : mapping of str to Gate, optional
        What each setpoint has to pass.
    late_s : float, optional
        How late a setpoint may come: the next one, in time, comes with it in one tick and brings
        the way of both. Arms that allow for it go to a setpoint no faster than their limits; others
        are there with the next tick.
    """

    def __init__(
        self,
        parameters: MotionParameters,
        kinematics: Mapping[str, ArmKinematics],
        drivers: Mapping[str, Driver],
        home: Mapping[str, Setpoint],
        gates: Mapping[str, Gate] = DIRECT_GATES,
        late_s: float = 0.0,
    ) -> None:
        self._parameters = parameters
        self._late_s = late_s
        self._gates = gates
        self._bounds = parameters.bounds
        self._arms = {
            name: _Arm(
                kinematics[name],
                drivers[name],
                ArmStatus(),
                setpoint,
                drivers[name].reset(setpoint),
            )
            for name, setpoint in home.items()
        }

    def take_over(self, arms: Mapping[str, ArmState], drivers: Mapping[str, Driver]) -> None:
        """Go on from where a trial left the arms, with its drivers."""
        for name, state in arms.items():
            arm = self._arms[name]
            arm.driver = drivers[name]
            arm.setpoint = Setpoint(state.setpoint_joints, state.setpoint_jaw_rad)
            arm.measured = Measured(state.joints, state.joint_velocities, state.jaw_rad)
            arm.wanted, arm.course = None, None

    def status(self, arm: str) -> ArmStatus:
        """Where an arm's state machine stands."""
        return self._arms[arm].status

    def busy(self, arm: str) -> bool:
        """Whether a `move_cp` is under way."""
        return self._arms[arm].course is not None

    @property
    def moving(self) -> bool:
        """Whether a further tick would change anything."""
        return any(
            arm.course is not None or arm.wanted is not None or not _rests(arm)
            for arm in self._arms.values()
        )

    def state_command(self, name: str, command: str) -> ArmStatus:
        """Follow a command of the state machine.

        Raises
        ------
        CommandRefused
            It is not legal in the present state.
        """
        arm = self._arms[name]
        arm.status = follow(name, arm.status, command)
        return arm.status

    def restore(self, name: str, status: ArmStatus) -> None:
        """Put an arm's state machine where it stood before this process."""
        self._arms[name].status = status

    def servo_jp(self, name: str, joints: Joints) -> None:
        """Want the joints to be somewhere with the next tick.

        Raises
        ------
        CommandRefused
            By the state machine or a gate; what was wanted before stays so.
        """
        arm = self._ready(name, "servo_jp")
        self._servo(name, "servo_jp", replace(_goal(arm), joints=joints))

    def servo_cp(self, name: str, tip_in_world: Pose) -> None:
        """Want the tip to be somewhere with the next tick; raises as `servo_jp`."""
        arm = self._ready(name, "servo_cp")
        with _named(name, "servo_cp"):
            joints = arm.kinematics.inverse(tip_in_world, arm.setpoint.joints)
        self._servo(name, "servo_cp", replace(_goal(arm), joints=joints))

    def servo_jaw(self, name: str, jaw_rad: float) -> None:
        """Want the jaw to be somewhere with the next tick; raises as `servo_jp`."""
        arm = self._ready(name, "jaw/servo_jp")
        self._servo(name, "jaw/servo_jp", replace(_goal(arm), jaw_rad=jaw_rad))

    def move_cp(self, name: str, tip_in_world: Pose) -> None:
        """Go along a straight line, from rest to rest.

        Raises
        ------
        CommandRefused
            By the state machine, or because the path leaves the arm's reach or fails a gate.
        """
        arm, p = self._ready(name, "move_cp"), self._parameters
        start = arm.kinematics.forward(arm.setpoint.joints)
        if path_length(start, tip_in_world) < _AT_POSE_M:
            return
        wished = Limits(p.free_speed_m_s, p.acceleration_m_s2, p.jerk_m_s3)
        with _named(name, "move_cp"):
            limits = limits_along(arm.kinematics, start, tip_in_world, arm.setpoint, wished)
            profile = rest_to_rest(path_length(start, tip_in_world), limits, p.dt_s)
            stroke = TurningStroke(
                profile, p.stop_deceleration_m_s2, start, tip_in_world, arm.kinematics
            )
            rehearse(
                (stroke,),
                arm.setpoint,
                arm.kinematics,
                p.dt_s,
                self._gates,
                self._bounds,
                self._others(arm),
            )
        arm.wanted = None
        arm.course = Course(Goal("", "move_cp", name), (stroke,), p)

    def tick(self, *, held: bool) -> list[CommandRefused]:
        """Do one tick of all arms; while somebody holds them, what was wanted is dropped.

        Returns
        -------
        list of CommandRefused
            Motions under way that a gate ended; their arms are in FAULT.
        """
        refused: list[CommandRefused] = []
        for name, arm in self._arms.items():
            halted = held or arm.status.state != "ENABLED"
            try:
                with _named(name, "move_cp" if arm.course else "servo_jp"):
                    self._advance(arm, halted=halted)
            except CommandRefused as refusal:
                # Its path had passed: something is wrong, and a person has to enable it again.
                arm.course, arm.status = None, replace(arm.status, state="FAULT")
                refused.append(refusal)
            arm.driver.send(arm.setpoint)
            arm.measured = arm.driver.measure(self._parameters.dt_s)
            arm.ticks_since_servo += 1
        return refused

    def snapshot(self, *, held: bool) -> dict[str, ArmState]:
        """Each arm as it is now."""
        return {
            name: ArmState(
                joints=arm.measured.joints,
                joint_velocities=arm.measured.joint_velocities,
                tip_in_world=arm.kinematics.forward(arm.measured.joints),
                jaw_rad=arm.measured.jaw_rad,
                setpoint_joints=arm.setpoint.joints,
                setpoint_jaw_rad=arm.setpoint.jaw_rad,
                operating_state=shown(arm.status, held=held),
            )
            for name, arm in self._arms.items()
        }

    def _ready(self, name: str, command: str) -> _Arm:
        arm = self._arms[name]
        if arm.status.state != "ENABLED":
            text = f"the arm is {arm.status.state}; enable or resume it first"
            raise CommandRefused(name, command, "wrong_state", text, state=arm.status.state)
        if not arm.status.is_homed:
            raise CommandRefused(name, command, "not_homed", "the arm is not homed; home it first")
        if arm.course is not None:
            text = "a move_cp is under way; await its end or pause the arm"
            raise CommandRefused(name, command, "busy", text)
        return arm

    def _servo(self, name: str, command: str, goal: Setpoint) -> None:
        arm, dt_s = self._arms[name], self._parameters.dt_s
        since_s = max(1, arm.ticks_since_servo) * dt_s + self._late_s
        elapsed_s = min(since_s, max(_LONGEST_STEP_S, dt_s))
        with _named(name, command):
            self._check(arm, goal, elapsed_s)
        arm.wanted, arm.is_fresh = goal, True

    def _advance(self, arm: _Arm, *, halted: bool) -> None:
        if halted:
            arm.wanted = None
        if arm.course is not None:
            if halted:
                arm.course.hold()
            progress = arm.course.step(_CALM, arm.setpoint, halted)
            self._check(arm, progress.setpoint, self._parameters.dt_s)
            arm.setpoint = progress.setpoint
            if progress.ending is not None or arm.course.stopped:
                arm.course = None
        elif arm.wanted is not None:
            if arm.is_fresh:
                arm.is_fresh, arm.ticks_since_servo = False, 0
            share = self._share(arm, arm.wanted) if self._late_s else 1.0
            if share < 1.0:
                arm.setpoint = _between(arm.setpoint, arm.wanted, share)
            else:
                arm.setpoint, arm.wanted = arm.wanted, None

    def _share(self, arm: _Arm, wanted: Setpoint) -> float:
        """Share of the way to a setpoint that one tick may bring, at most 1."""
        now, dt_s = arm.setpoint, self._parameters.dt_s
        tips = (arm.kinematics.forward(one.joints).position_m for one in (now, wanted))
        needed_s = (
            *(
                abs(b - a) / joint.speed
                for joint, a, b in zip(JOINTS, now.joints, wanted.joints, strict=True)
            ),
            abs(wanted.jaw_rad - now.jaw_rad) / self._bounds.jaw_speed_rad_s,
            dist(*tips) / self._bounds.speed_m_s,
        )
        return min(1.0, dt_s / max(dt_s, *needed_s))

    def _check(self, arm: _Arm, after: Setpoint, dt_s: float) -> None:
        kinematics = arm.kinematics
        # NaN has no pose: its gate is asked first.
        tip_before = kinematics.forward(arm.setpoint.joints)
        tip_after = kinematics.forward(after.joints)
        step = Step(
            dt_s=dt_s,
            before=arm.setpoint,
            after=after,
            tip_before=tip_before,
            tip_after=tip_after,
            orientation_xyzw=kinematics.tool_down_xyzw,
            instrument_before=kinematics.instrument(arm.setpoint.joints, tip_before),
            instrument_after=kinematics.instrument(after.joints, tip_after),
            others=self._others(arm),
        )
        for gate in self._gates.values():
            gate(step, self._bounds)

    def _others(self, arm: _Arm) -> dict[str, Instrument]:
        """Where the other arms are, and where they will be after the next tick."""
        others: dict[str, Instrument] = {}
        for name, other in self._arms.items():
            if other is arm:
                continue
            others[name] = _instrument(other, other.setpoint)
            if other.wanted is not None:
                others[f"{name}, where it goes"] = _instrument(other, other.wanted)
        return others


def shown(status: ArmStatus, *, held: bool) -> str:
    """State as the arm publishes it: enabled arms that somebody holds are paused."""
    return "PAUSED" if held and status.state == "ENABLED" else status.state


def _instrument(arm: _Arm, setpoint: Setpoint) -> Instrument:
    tip = arm.kinematics.forward(setpoint.joints)
    return arm.kinematics.instrument(setpoint.joints, tip)


def _between(start: Setpoint, end: Setpoint, share: float) -> Setpoint:
    a, b, c, d, e, f = (p + share * (q - p) for p, q in zip(start.joints, end.joints, strict=True))
    jaw_rad = start.jaw_rad + share * (end.jaw_rad - start.jaw_rad)
    return Setpoint((a, b, c, d, e, f), jaw_rad)


def _goal(arm: _Arm) -> Setpoint:
    return arm.wanted or arm.setpoint


def _rests(arm: _Arm) -> bool:
    pairs = zip(arm.measured.joints, arm.setpoint.joints, strict=True)
    jaw = abs(arm.measured.jaw_rad - arm.setpoint.jaw_rad)
    return max(jaw, *(abs(a - b) for a, b in pairs)) < _AT_REST


@contextmanager
def _named(arm: str, command: str) -> Generator[None]:
    """Turn what the core refuses into a refusal of the command."""
    try:
        yield
    except GateRefused as fault:
        raise CommandRefused(arm, command, fault.gate, str(fault), **fault.values) from fault
    except Unreachable as fault:
        raise CommandRefused(arm, command, "unreachable", str(fault), **fault.values) from fault
    except ProfileImpossible as fault:
        raise CommandRefused(arm, command, "profile", str(fault), **fault.values) from fault
