"""Between messages and the motion controller."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import cast

from fras_common import messages as m
from fras_common.messages.motion import ActionOutcome
from fras_common.messages.robot import Joints
from fras_common.scenario import Scenario
from fras_motion.kinematics import Pose
from fras_motion.parameters import MotionParameters
from fras_motion.safety import Box
from fras_motion.states import ActionResult, ActionState, ArmState, Goal, Snapshot, Verdict


def parameters_of(scenario: Scenario) -> MotionParameters:
    """Speeds and limits of the scenario."""
    motion = scenario.motion
    return MotionParameters(
        dt_s=scenario.tissue.dt_s,
        free_speed_m_s=motion.free_speed_m_s,
        holding_speed_m_s=motion.holding_speed_m_s,
        acceleration_m_s2=motion.acceleration_m_s2,
        jerk_m_s3=motion.jerk_m_s3,
        stop_deceleration_m_s2=motion.stop_deceleration_m_s2,
        jaw_speed_rad_s=motion.jaw_speed_rad_s,
        jaw_closed_below_rad=scenario.awareness.closed_jaw_rad,
        lift_height_m=motion.lift_height_m,
        clearance_height_m=motion.clearance_height_m,
        retreat_max_m=motion.retreat_max_m,
        driver_time_constant_s=motion.joint_time_constant_s,
        driver_delay_s=motion.joint_delay_s,
        driver_noise_rad=motion.joint_noise_rad,
        driver_noise_m=motion.insertion_noise_m,
        driver_seed=scenario.seed,
        instrument_clearance_m=motion.instrument_clearance_m,
        forbidden_boxes=tuple(Box(box.lower_m, box.upper_m) for box in motion.forbidden_boxes),
    )


def goal_of(request: m.ExecuteRequest) -> Goal:
    """Read the action that shall be done."""
    return Goal(request.goal_id, request.name, request.arm, request.block, request.target_m)


def verdict_of(verdict: m.Verdict) -> Verdict:
    """Read what the controller needs of a verdict."""
    return Verdict(
        tick=verdict.tick,
        level=verdict.level,
        reason=verdict.reason,
        max_force_n=verdict.max_force_n,
        limit_n=verdict.limit_n,
        max_node_speed_m_s=verdict.max_node_speed_m_s,
        grasped=verdict.grasped,
    )


def robot_state(
    snapshot: Snapshot, trial: str, operating_state: Callable[[str], str]
) -> m.RobotState:
    """Put the robot at one tick on the wire; `operating_state` knows an arm's state by CRTK."""
    action = snapshot.action
    return m.RobotState(
        tick=snapshot.tick,
        trial=trial,
        arms={
            name: _arm_state(replace(arm, operating_state=operating_state(name)))
            for name, arm in snapshot.arms.items()
        },
        action=m.ActionState(
            goal_id=action.goal_id,
            name=action.name,
            arm=action.arm,
            block=action.block or "",
            phase=action.phase,
        )
        if action is not None
        else None,
        holds=dict(snapshot.holds),
        verdict_tick=snapshot.verdict_tick,
    )


def action_result(result: ActionResult, goal: Goal, trial: str) -> m.ActionResult:
    """Put the end of an action on the wire."""
    return m.ActionResult(
        tick=result.tick,
        trial=trial,
        goal_id=result.goal_id,
        name=goal.name,
        arm=goal.arm,
        block=goal.block or "",
        outcome=cast(ActionOutcome, result.outcome),
        reason=result.reason,
        text=result.text,
        values=in_words(result.values),
    )


def in_words(values: Mapping[str, object]) -> dict[str, str]:
    """Put the numbers behind a refusal on the wire."""
    return {name: str(value) for name, value in values.items()}


def _arm_state(arm: ArmState) -> m.ArmState:
    pose = arm.tip_in_world
    return m.ArmState(
        joints=cast(Joints, tuple(arm.joints)),
        joint_velocities=cast(Joints, tuple(arm.joint_velocities)),
        tip_in_world=m.Pose(
            position_m=pose.position_m,
            quaternion_xyzw=pose.quaternion_xyzw,
        ),
        jaw_rad=arm.jaw_rad,
        setpoint_joints=cast(Joints, tuple(arm.setpoint_joints)),
        setpoint_jaw_rad=arm.setpoint_jaw_rad,
        operating_state=arm.operating_state,  # type: ignore[arg-type]
        grasp_height_m=arm.grasp_height_m,
        hard_latched=arm.hard_latched,
    )


def snapshot_of(state: m.RobotState) -> Snapshot:
    """Read the robot at one tick, as another process told it."""
    action = state.action
    return Snapshot(
        tick=state.tick,
        arms={name: _arm_of(arm) for name, arm in state.arms.items()},
        action=ActionState(
            action.goal_id, action.name, action.arm, action.block or None, action.phase
        )
        if action is not None
        else None,
        holds=dict(state.holds),
        verdict_tick=state.verdict_tick,
    )


def _arm_of(arm: m.ArmState) -> ArmState:
    tip = arm.tip_in_world
    return ArmState(
        joints=arm.joints,
        joint_velocities=arm.joint_velocities,
        tip_in_world=Pose(tip.position_m, tip.quaternion_xyzw),
        jaw_rad=arm.jaw_rad,
        setpoint_joints=arm.setpoint_joints,
        setpoint_jaw_rad=arm.setpoint_jaw_rad,
        operating_state=arm.operating_state,
        grasp_height_m=arm.grasp_height_m,
        hard_latched=arm.hard_latched,
    )
