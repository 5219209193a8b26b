"""Messages of a small trial, as the surgeon's page hears them, and pictures made of them."""

from typing import Any

import msgspec
import numpy as np

from fras_common import messages as m
from fras_common.messages.base import Array
from fras_monitor.picture import Picture, apply, with_token
from support import verdicts

TRIAL = "t-1"
SERVICES = ("sim", "sa", "planner", "motion", "recorder")
# Two triangles of a square.
REST_M = np.array([[0.0, 0.0, 0.005], [0.1, 0.0, 0.005], [0.0, 0.1, 0.005], [0.1, 0.1, 0.005]])
SURFACE = np.array([[0, 1, 2], [1, 3, 2]])


def health(service: str, state: str = "ready") -> m.Health:
    return m.Health(
        service=service, state=state, rss_bytes=0, cpu_percent=0.0, received=0, published=0,
        malformed=0, refused=0, wrong_trial=0, queue_depth=0, queue_dropped=0, gaps=0, facts={},
    )  # fmt: skip


def task(
    phase: str = "acting", action: str = "", trial: str = TRIAL, **others: Any
) -> m.TaskStatus:
    values: dict[str, Any] = {
        "goal_id": "", "tried": [], "plans": 1, "replans": 0, "scenario_kind": "A", "actions": [],
        "outcome": "", "reason": "", "violations": [], **others,
    }  # fmt: skip
    return m.TaskStatus(trial=trial, phase=phase, action=action, **values)  # type: ignore[arg-type]


def done(goal: int, action: str, plan: str = "c1") -> m.DoneAction:
    return m.DoneAction(goal=goal, action=action, context="c1", plan=plan)


def plan(request_id: str, *texts: str, reason: str = "initial", **others: Any) -> m.Plan:
    values: dict[str, Any] = {
        "criterion": "weighted", "goal": "visible", "asp_digest": "", "ignore_ap": False,
        "tried": [], "target": "b(3,4)", "arm": "psm1", "history": [], "cost": [], "models": 1,
        "ground_s": 0.0, "solve_s": 0.0, "explanation": [], "no_plan": None, "trial": TRIAL,
        **others,
    }  # fmt: skip
    actions = [
        m.PlannedAction(t=t, text=text, name=text.partition("(")[0], args=[], expected=[])
        for t, text in enumerate(texts, start=1)
    ]
    return m.Plan(request_id=request_id, reason=reason, actions=actions, **values)


def arm(jaw_rad: float = 1.0, **others: Any) -> m.ArmState:
    still = (0.0,) * 6
    values: dict[str, Any] = {
        "joints": (0.0, 0.0, 0.1, 0.0, 0.0, 0.0), "joint_velocities": still,
        "tip_in_world": m.Pose(position_m=(0.02, 0.03, 0.02), quaternion_xyzw=(1.0, 0.0, 0.0, 0.0)),
        "setpoint_joints": still, "setpoint_jaw_rad": jaw_rad, "operating_state": "ENABLED",
        **others,
    }  # fmt: skip
    return m.ArmState(jaw_rad=jaw_rad, **values)


def robot(
    tick: int = 1,
    phase: str | None = None,
    holds: dict[str, str] | None = None,
    name: str = "pull",
    trial: str = TRIAL,
    **of_arm: Any,
) -> m.RobotState:
    action = None
    if phase is not None:
        action = m.ActionState(goal_id="g1", name=name, arm="psm1", block="b(2,1)", phase=phase)
    return m.RobotState(
        tick=tick, trial=trial, arms={"psm1": arm(**of_arm), "psm2": arm()}, action=action,
        holds=holds or {}, verdict_tick=tick - 1,
    )  # fmt: skip


def model(trial: str = TRIAL) -> m.TissueModel:
    return m.TissueModel(
        trial=trial, nodes_m=Array.of(REST_M, "<f8"), elements=Array.of(np.zeros((0, 8)), "<i4"),
        surface=Array.of(SURFACE, "<i4"), fixed_nodes=Array.of(np.array([0]), "<i4"),
        fixed_patch=Array.of(np.array([0]), "<i4"),
        fixed_points_m=Array.of(np.array([[0.01, 0.01, 0.0]]), "<f8"), roi_m=(0.05, 0.05, 0.0),
        young_modulus_pa=3000.0, poisson_ratio=0.45, dt_s=0.02,
    )  # fmt: skip


def tissue(tick: int = 1, lift_m: float = 0.0, force_n: float = 0.0) -> m.TissueState:
    forces = np.zeros((4, 3))
    forces[3, 2] = force_n
    solver = m.SolverReport(
        iterations=1, residual=0.0, refactored=False, wall_s=0.0, converged=True,
        inverted_elements=0,
    )  # fmt: skip
    return m.TissueState(
        tick=tick, trial=TRIAL, nodes_m=Array.of(REST_M + np.array([0.0, 0.0, lift_m]), "<f4"),
        nodal_force_n=Array.of(forces, "<f4"), max_force_n=force_n, max_node_speed_m_s=0.0,
        tool_force_n={}, grasped={}, grasped_force_n={},
        patch_force_n=Array.of(np.zeros((0, 3)), "<f4"), balance_residual_n=0.0, solver=solver,
    )  # fmt: skip


def context(
    *fluents: str, tick: int = 1, evidence: dict[str, dict[str, float]] | None = None
) -> m.Context:
    return m.Context(
        tick=tick, trial=TRIAL, request_id="c1", fluents=list(fluents), evidence=evidence or {},
        names=["b(1,1)", "b(1,2)", "b(2,1)", "b(2,2)"],
        blocks_m=[(0.025, 0.025, 0.005), (0.025, 0.075, 0.005), (0.075, 0.025, 0.005),
                  (0.075, 0.075, 0.005)],
        roi_m=(0.05, 0.05, 0.0), fixed_points_m=[], monitored=[],
    )  # fmt: skip


def verdict(tick: int = 1, trial: str = TRIAL, level: Any = "ok", **others: Any) -> m.Verdict:
    return msgspec.structs.replace(verdicts.verdict(tick, trial, level), **others)


def picture_of(*messages: object, at_s: float = 0.0, services: Any = SERVICES) -> Picture:
    """Return the picture of a cell whose services all work and that said these messages."""
    picture = Picture()
    for service in services:
        picture = with_token(picture, f"alive/{service}/1", present=True)
        picture = apply(picture, health(service), at_s)
    for message in messages:
        picture = apply(picture, message, at_s)
    return picture


def recorder_status(state: Any, lost: int = 0) -> m.RecorderStatus:
    return m.RecorderStatus(state=state, path="", messages=9, bytes=9, lost=lost, reason="")
