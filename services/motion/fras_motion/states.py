"""What goes into the motion controller and what comes out of it, as frozen values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from fras_motion.kinematics import Joints, Pose, Vector3

__all__ = [
    "ActionResult",
    "ActionState",
    "Advance",
    "ArmState",
    "Goal",
    "Snapshot",
    "Verdict",
]


# Of the last tick of an action.
_FINAL_PHASES = ("done", "interrupted")


@dataclass(frozen=True)
class Goal:
    """An action that shall be done.

    Parameters
    ----------
    goal_id : str
        Comes back in the result.
    name : str
        reach, grasp, release, pull or move.
    arm : str
        Which arm shall do it.
    block : str or None
        The block it is about, for the record.
    target_m : tuple of float, length 3, or None
        Where to, world frame [m]; needed by reach and move (which uses x and y).
    """

    goal_id: str
    name: str
    arm: str
    block: str | None = None
    target_m: Vector3 | None = None

    def in_phase(self, phase: str) -> ActionState:
        """Tell the action as it is in a phase."""
        return ActionState(self.goal_id, self.name, self.arm, self.block, phase)


@dataclass(frozen=True)
class Verdict:
    """What situation awareness says about one tick.

    Parameters
    ----------
    tick : int
        The tick it judges.
    level : str
        ok, soft, hard or invalid.
    reason : str
        Why it is invalid, e.g. solver.
    max_force_n, limit_n : float
        The force the tissue bears and the soft limit [N].
    max_node_speed_m_s : float
        Speed of the tissue's fastest node.
    grasped : mapping of str to int
        Arm -> number of tissue nodes in its jaw.
    """

    tick: int
    level: str = "ok"
    reason: str = ""
    max_force_n: float = 0.0
    limit_n: float = 0.5
    max_node_speed_m_s: float = 0.0
    grasped: Mapping[str, int] = field(default_factory=dict[str, int])


@dataclass(frozen=True)
class ArmState:
    """One arm at one tick.

    Parameters
    ----------
    joints, joint_velocities : tuple of float, length 6
        As measured [rad, rad/s; m, m/s for the insertion].
    tip_in_world : Pose
        Of the measured joints.
    jaw_rad : float
        As measured.
    setpoint_joints : tuple of float, length 6
        As last sent.
    setpoint_jaw_rad : float
        As last sent.
    operating_state : str
        CRTK: ENABLED, or PAUSED while somebody holds the arms.
    grasp_height_m : float or None
        Height of the tip when the jaw closed [m]; None while it is open.
    hard_latched : bool
        Whether the arm crossed the hard limit and has not released since.
    """

    joints: Joints
    joint_velocities: Joints
    tip_in_world: Pose
    jaw_rad: float
    setpoint_joints: Joints
    setpoint_jaw_rad: float
    operating_state: str
    grasp_height_m: float | None = None
    hard_latched: bool = False


@dataclass(frozen=True)
class ActionState:
    """The running action, or the last one.

    Parameters
    ----------
    goal_id, name, arm, block
        Of its goal.
    phase : str
        rise, traverse, descend (reach); close (grasp); open (release); lift (pull); carry (move);
        then settle and, at its last tick, done; or stop, retreat, held and, at its last tick,
        interrupted.
    """

    goal_id: str
    name: str
    arm: str
    block: str | None
    phase: str

    def ended(self) -> ActionState:
        """Tell the action as one that does not go on."""
        over = self.phase in _FINAL_PHASES
        return self if over else replace(self, phase="interrupted")


@dataclass(frozen=True)
class Snapshot:
    """The robot at one tick.

    Parameters
    ----------
    tick : int
        Logical time.
    arms : mapping of str to ArmState
        By arm.
    action : ActionState or None
        The running action; an ended one stays, with its last phase, until the next one's first
        tick. None from a reset to the first action.
    holds : mapping of str to str
        Holder -> reason.
    verdict_tick : int
        The verdict this tick was moved on; -1 after a reset.
    """

    tick: int
    arms: Mapping[str, ArmState]
    action: ActionState | None
    holds: Mapping[str, str]
    verdict_tick: int


@dataclass(frozen=True)
class ActionResult:
    """How an action ended.

    Parameters
    ----------
    goal_id : str
        Of its goal.
    outcome : str
        succeeded, failed, interrupted or aborted.
    reason : str
        Empty for success; nothing_in_reach, force_soft, force_hard, hold, hold:<who>, gate:<name>.
    tick : int
        Its last tick.
    text : str
        What a gate that ended it said; empty else.
    values : mapping of str to object
        The numbers behind the text.
    """

    goal_id: str
    outcome: str
    reason: str
    tick: int
    text: str = ""
    values: Mapping[str, object] = field(default_factory=dict[str, object])


@dataclass(frozen=True)
class Advance:
    """One tick.

    Parameters
    ----------
    snapshot : Snapshot
        The robot after it.
    result : ActionResult or None
        The running action's result, if this tick ended it.
    interventions : tuple of str
        Safeguards that stopped or refused something in this tick.
    """

    snapshot: Snapshot
    result: ActionResult | None
    interventions: tuple[str, ...] = ()
