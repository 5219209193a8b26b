"""The motion controller: the only clock of the system, and the only one that moves the arms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import product

from fras_motion.drivers import Driver, DriverFault, Measured, Setpoint
from fras_motion.kinematics import (
    BASES_IN_WORLD,
    HOME_TIPS_M,
    ArmKinematics,
    Instrument,
    Pose,
    Unreachable,
)
from fras_motion.safety import CHECKS, GATES, Gate, GateRefused, Situation, Step, box_distance_m
from fras_motion.trajectory import ProfileImpossible

from .course import Course, Ending, Progress
from .errors import InvalidParameter, NoTickWanted, Refused, StaleVerdict
from .parameters import MotionParameters
from .primitives import PRIMITIVES, Posture
from .rehearsal import rehearse
from .robots import home_setpoints, simulated_drivers
from .states import ActionResult, ActionState, Advance, ArmState, Goal, Snapshot, Verdict

__all__ = ["MotionController"]


class MotionController:
    """Two arms, one action at a time, one tick per verdict.

    Parameters
    ----------
    parameters : MotionParameters, optional
        The numbers of motion.
    bases_in_world : mapping of str to Pose, optional
        Arm -> its remote centre of motion.
    home_tips_m : mapping of str to tuple of float, optional
        Arm -> where its tip stands after a reset, world frame [m].
    drivers : mapping of str to Driver, optional
        Arm -> its robot; simulated ones by default.
    gates : mapping of str to Gate, optional
        What each setpoint has to pass.

    Raises
    ------
    Unreachable
        An arm can't be at its home.
    InvalidParameter
        A forbidden box reaches an arm at its home.
    """

    def __init__(
        self,
        parameters: MotionParameters | None = None,
        bases_in_world: Mapping[str, Pose] = BASES_IN_WORLD,
        home_tips_m: Mapping[str, tuple[float, float, float]] = HOME_TIPS_M,
        drivers: Mapping[str, Driver] | None = None,
        gates: Mapping[str, Gate] = GATES,
    ) -> None:
        p = self._parameters = parameters or MotionParameters()
        self._gates = gates
        self._bounds = p.bounds
        self.arms = {name: ArmKinematics(base) for name, base in bases_in_world.items()}
        self._drivers = drivers or simulated_drivers(p, self.arms)
        self._home = home_setpoints(self.arms, home_tips_m, p)
        self._holds: dict[str, str] = {}
        self.reset()
        for box, instrument in product(p.forbidden_boxes, self._instruments.values()):
            if not box_distance_m(instrument, box.lower_m, box.upper_m) >= 0.0:
                raise InvalidParameter("forbidden_boxes", box, "no box reaches an arm at its home")

    def reset(self) -> Snapshot:
        """Back to tick 0, the arms at home. Holds stay: a reset is no surgeon's consent.

        Returns
        -------
        Snapshot
            The robot at tick 0.
        """
        self._stand(self._home)
        self._measured = {
            name: self._drivers[name].reset(setpoint) for name, setpoint in self._home.items()
        }
        self._grasp_heights: dict[str, float] = {}
        self._latched: set[str] = set()
        self._last = self._observe(0, None, -1)
        return self.snapshot

    def take_over(self, before: Snapshot) -> None:
        """Stand where another controller stood that is no more; what it did is over.

        Parameters
        ----------
        before : Snapshot
            The last that it told.

        Raises
        ------
        InvalidParameter
            It had other arms.
        DriverFault
            An arm does not stand there.
        """
        if before.arms.keys() != self.arms.keys():
            raise InvalidParameter("arms", sorted(before.arms), f"{sorted(self.arms)}")
        setpoints = {
            name: Setpoint(arm.setpoint_joints, arm.setpoint_jaw_rad)
            for name, arm in before.arms.items()
        }
        for name, arm in before.arms.items():
            measured = Measured(arm.joints, arm.joint_velocities, arm.jaw_rad)
            driver = self._drivers[name]
            self._measured[name] = driver.resume(setpoints[name], measured, before.tick)
        self._stand(setpoints)
        self._grasp_heights = {
            name: arm.grasp_height_m
            for name, arm in before.arms.items()
            if arm.grasp_height_m is not None
        }
        self._latched = {name for name, arm in before.arms.items() if arm.hard_latched}
        self._last = replace(before, action=before.action and before.action.ended())

    def _stand(self, setpoints: Mapping[str, Setpoint]) -> None:
        """Be at rest at setpoints."""
        self._setpoints = dict(setpoints)
        self._tips = {name: self.arms[name].forward(one.joints) for name, one in setpoints.items()}
        self._instruments = {
            name: self.arms[name].instrument(one.joints, self._tips[name])
            for name, one in setpoints.items()
        }
        self._course: Course | None = None

    @property
    def snapshot(self) -> Snapshot:
        """The robot at its last tick, with the holds of now."""
        course, last = self._course, self._last
        state = "PAUSED" if self._holds else "ENABLED"
        action = last.action
        if course is not None and course.stopped and self._holds:
            action = course.goal.in_phase("held")
        return replace(
            last,
            arms={
                name: replace(arm, operating_state=state, hard_latched=name in self._latched)
                for name, arm in last.arms.items()
            },
            action=action,
            holds=dict(sorted(self._holds.items())),
        )

    @property
    def drivers(self) -> Mapping[str, Driver]:
        """The robots, by arm."""
        return self._drivers

    @property
    def wants_tick(self) -> bool:
        """Whether an action runs, stops, retreats or settles; else logical time stands still."""
        course = self._course
        return course is not None and not (self._holds and course.stopped)

    @property
    def verdict_tick(self) -> int:
        """The verdict on which the arms came to where they are; -1 after a reset."""
        return self._last.verdict_tick

    @property
    def hard_latched(self) -> bool:
        """Whether an arm crossed the hard limit and has not succeeded in a release since."""
        return bool(self._latched)

    def execute(self, goal: Goal) -> None:
        """Accept an action, after its whole path has passed every gate.

        Parameters
        ----------
        goal : Goal
            What shall be done.

        Raises
        ------
        Refused
            With its reason; the arms stay where they are.
        """
        running = self._course.goal if self._course is not None else None
        situation = Situation(running, PRIMITIVES, self.arms, self.hard_latched)
        for check in CHECKS.values():
            check(goal, situation)
        self._course = self._plan(goal)
        if self._holds:
            self._course.hold()

    def hold(self, holder: str, reason: str) -> None:
        """Stop, and do not move until every holder has lifted its hold.

        Parameters
        ----------
        holder : str
            Who holds; a second hold of the same holder replaces its reason.
        reason : str
            Why.
        """
        self._holds[holder] = reason
        if self._course is not None:
            self._course.hold()

    def resume(self, holder: str) -> bool:
        """Lift a hold. When the last is lifted, the held action ends with the next tick.

        Parameters
        ----------
        holder : str
            Whose hold.

        Returns
        -------
        bool
            Whether there was one.
        """
        return self._holds.pop(holder, None) is not None

    def abort(self, reason: str) -> ActionResult | None:
        """End the running action without a tick, for no verdict may ever come again.

        The arms stay at their last setpoint. `snapshot` shows the end at the present tick.

        Parameters
        ----------
        reason : str
            Why, e.g. ``hold:sim``.

        Returns
        -------
        ActionResult or None
            None when no action runs.
        """
        course = self._course
        if course is None:
            return None
        self._course = None
        self._last = replace(self._last, action=course.goal.in_phase("interrupted"))
        return Ending("aborted", reason).result(course.goal, self._last.tick)

    def expect(self, tick: int) -> None:
        """Refuse a verdict that does not judge the present tick.

        Parameters
        ----------
        tick : int
            The tick it judges.

        Raises
        ------
        StaleVerdict
            Another one than that at which the arms stand.
        """
        if tick != self._last.tick:
            raise StaleVerdict(self._last.tick, tick)

    def advance(self, verdict: Verdict) -> Advance:
        """Do one tick.

        Parameters
        ----------
        verdict : Verdict
            On the present tick.

        Returns
        -------
        Advance
            The robot after it, and the action's result if it ended.

        Raises
        ------
        StaleVerdict
            The verdict judges another tick.
        NoTickWanted
            No action runs, or it is held at rest.
        """
        self.expect(verdict.tick)
        course = self._course
        if course is None or not self.wants_tick:
            raise NoTickWanted(self._last.tick, tuple(sorted(self._holds)))
        reaction = course.react(verdict)
        if verdict.level == "hard" and course.goal.name != "release":
            holding = {name for name, arm in self._measured.items() if self._closed(arm)}
            self._latched |= holding or {course.goal.arm}
        progress = self._checked(course, verdict)
        try:
            for name, driver in self._drivers.items():
                driver.send(self._setpoints[name])
            for name, driver in self._drivers.items():
                self._measured[name] = driver.measure(self._parameters.dt_s)
        except DriverFault as fault:
            ending = Ending("aborted", f"hold:{fault.whose}", str(fault), fault.values)
            progress = replace(progress, phase="interrupted", ending=ending)
        self._remember_grasp(course.goal.arm)
        tick = self._last.tick + 1
        self._last = self._observe(tick, course.goal.in_phase(progress.phase), verdict.tick)
        result = None
        if progress.ending is not None:
            result = progress.ending.result(course.goal, tick)
            self._course = None
            if course.goal.name == "release" and result.outcome == "succeeded":
                self._latched.discard(course.goal.arm)
        acted = tuple(name for name in (reaction, progress.refused_by) if name)
        return Advance(self.snapshot, result, acted)

    def _plan(self, goal: Goal) -> Course:
        """Lay out an action and walk its whole path through the gates."""
        arm = self.arms[goal.arm]
        posture = Posture(
            arm,
            self._setpoints[goal.arm],
            self._tips[goal.arm].position_m,
            self._closed(self._measured[goal.arm]),
            self._grasp_heights.get(goal.arm),
        )
        try:
            strokes = PRIMITIVES[goal.name](goal, posture, self._parameters)
            rehearse(
                strokes,
                posture.setpoint,
                arm,
                self._parameters.dt_s,
                self._gates,
                self._bounds,
                self._others(goal.arm),
            )
        except Unreachable as fault:
            raise Refused("unreachable", str(fault), **fault.values) from fault
        except GateRefused as fault:
            raise Refused(fault.gate, str(fault), **fault.values) from fault
        except ProfileImpossible as fault:
            raise Refused("profile", str(fault), **fault.values) from fault
        return Course(goal, strokes, self._parameters)

    def _checked(self, course: Course, verdict: Verdict) -> Progress:
        """Let the action step; a step that fails a gate is not sent and ends the action."""
        name = course.goal.arm
        before, arm = self._setpoints[name], self.arms[name]
        try:
            progress = course.step(verdict, before, bool(self._holds))
            after = arm.forward(progress.setpoint.joints)
            step = Step(
                dt_s=self._parameters.dt_s,
                before=before,
                after=progress.setpoint,
                tip_before=self._tips[name],
                tip_after=after,
                orientation_xyzw=arm.tool_down_xyzw,
                instrument_before=self._instruments[name],
                instrument_after=arm.instrument(progress.setpoint.joints, after),
                others=self._others(name),
            )
            for gate in self._gates.values():
                gate(step, self._bounds)
        except GateRefused as fault:
            return Progress.refused(before, fault.gate, fault)
        except Unreachable as fault:
            return Progress.refused(before, "unreachable", fault)
        self._setpoints[name], self._tips[name] = step.after, step.tip_after
        self._instruments[name] = step.instrument_after
        return progress

    def _others(self, name: str) -> dict[str, Instrument]:
        return {other: one for other, one in self._instruments.items() if other != name}

    def _remember_grasp(self, name: str) -> None:
        """Note the height at which a jaw closed: at the crossing, where the simulator grasps."""
        if not self._closed(self._measured[name]):
            self._grasp_heights.pop(name, None)
        elif name not in self._grasp_heights:
            self._grasp_heights[name] = self._tips[name].position_m[2]

    def _closed(self, measured: Measured) -> bool:
        return measured.jaw_rad < self._parameters.jaw_closed_below_rad

    def _observe(self, tick: int, action: ActionState | None, verdict_tick: int) -> Snapshot:
        arms = {
            name: ArmState(
                joints=measured.joints,
                joint_velocities=measured.joint_velocities,
                tip_in_world=self.arms[name].forward(measured.joints),
                jaw_rad=measured.jaw_rad,
                setpoint_joints=self._setpoints[name].joints,
                setpoint_jaw_rad=self._setpoints[name].jaw_rad,
                operating_state="ENABLED",
                grasp_height_m=self._grasp_heights.get(name),
            )
            for name, measured in self._measured.items()
        }
        return Snapshot(tick, arms, action, {}, verdict_tick)
