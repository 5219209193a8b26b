"""A small but whole trial of kind B, written as the recorder writes it.

The pull crosses the limit, retreats, a re-plan moves sideways, the goal is then found reached.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray

from fras_common.bus import RawSample
from fras_common.codec import encode
from fras_common.messages import (
    ActionResult,
    ActionState,
    ArmState,
    Array,
    Header,
    Health,
    LogRecord,
    Plan,
    PlannedAction,
    Pose,
    RobotState,
    RpcRecord,
    TaskReply,
    TaskRequest,
    TaskStatus,
    TissueModel,
    TissueState,
    Verdict,
)
from fras_common.messages.motion import ActionOutcome
from fras_common.scenario import Scenario, TissueSection, attachment_raster, resolve, to_toml
from fras_common.scenario.geometry import nodes_in_discs
from fras_log import LogFile
from support.tissues import let_alone

TRIAL = "t-7"
START_NS = 1_760_000_000_000_000_000
TICK_NS = 4_000_000
HEX8_FACES = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
)
BLOCK = "b(4,4)"
GRASP_M = np.array([0.05, 0.06, 0.005])
# Each goal with its arm's action, last tick, and the tip's height at that tick.
GOALS: tuple[tuple[str, str, int, ActionOutcome, str], ...] = (
    ("g1", "reach", 18, "succeeded", ""),
    ("g2", "grasp", 24, "succeeded", ""),
    ("g3", "pull", 50, "interrupted", "force_soft"),
    ("g4", "move", 64, "succeeded", ""),
)
LAST_TICK = 64
STILL = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass
class LogWriter:
    """Stamps and writes messages one by one; what a test changes goes through `put`."""

    file: LogFile
    now_ns: int = START_NS
    seqs: dict[str, int] = field(default_factory=dict[str, int])

    def put(self, key: str, message: Header, trial: str = TRIAL, skip: int = 0) -> None:
        source = f"{key.partition('/')[0]}/1"
        seq = self.seqs.get(key, 0) + skip
        self.seqs[key] = seq + 1
        stamped = msgspec.structs.replace(
            message, stamp_ns=self.now_ns, seq=seq, source=source, trial=trial
        )
        self.file.write(RawSample(key, encode(stamped), "application/msgpack"), self.now_ns)

    def raw(self, key: str, payload: bytes) -> None:
        self.file.write(RawSample(key, payload, ""), self.now_ns)


def scenario() -> Scenario:
    return resolve(Scenario(name="b", seed=7, tissue=TissueSection(dt_s=0.1)))


def open_log(path: Path, trial: str = TRIAL) -> LogWriter:
    metadata = {
        "trial": trial,
        "fras_version": "0.1.0",
        "python_version": "3.11.7",
        "host": "theatre-1",
        "scenario": to_toml(scenario()),
    }
    return LogWriter(LogFile(path, metadata, {"scenario.toml": b""}, START_NS))


def box() -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    nx, ny, nz = scenario().tissue.node_counts
    size = scenario().tissue.size_m
    y, x, z = np.meshgrid(
        np.linspace(0, size[1], ny),
        np.linspace(0, size[0], nx),
        np.linspace(0, size[2], nz),
        indexing="ij",
    )
    nodes = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    ids = np.arange(nx * ny * nz).reshape(ny, nx, nz)
    corners = (
        (0, 0, 0),
        (1, 0, 0),
        (1, 1, 0),
        (0, 1, 0),
        (0, 0, 1),
        (1, 0, 1),
        (1, 1, 1),
        (0, 1, 1),
    )
    cells = [ids[j : ny - 1 + j, i : nx - 1 + i, k : nz - 1 + k].ravel() for i, j, k in corners]
    return nodes, np.stack(cells, axis=1).astype(np.int32)


def model() -> TissueModel:
    scene = scenario().scene
    assert scene is not None
    nodes, elements = box()
    faces = elements[:, HEX8_FACES].reshape(-1, 4)
    _, first, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    surface = faces[np.sort(first[count == 1])][:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    bottom = np.flatnonzero(nodes[:, 2] == 0).astype(np.int32)
    return TissueModel(
        tick=0,
        nodes_m=Array.of(nodes, "<f8"),
        elements=Array.of(elements, "<i4"),
        surface=Array.of(surface, "<i4"),
        fixed_nodes=Array.of(nodes_in_discs(nodes, bottom, scene.discs), "<i4"),
        fixed_patch=Array.of(np.zeros_like(nodes_in_discs(nodes, bottom, scene.discs)), "<i4"),
        fixed_points_m=Array.of(attachment_raster(scenario().tissue.size_m, scene.discs), "<f8"),
        roi_m=scene.roi_m,
        young_modulus_pa=3000.0,
        poisson_ratio=0.45,
        dt_s=0.1,
    )


def lift_m(tick: int) -> float:
    """Up to 30 mm at tick 47, 3 mm back in the retreat, held in the move."""
    return float(np.interp(tick, [24, 47, 50], [0.0, 0.030, 0.027]))


def force_n(tick: int) -> float:
    """Crosses the limit of 0.5 N at ticks 46, 47 and 48."""
    return (
        0.0
        if tick <= 24
        else float(np.interp(tick, [25, 46, 47, 48, 49], [0.05, 0.51, 0.55, 0.52, 0.46]))
    )


def visibility(tick: int) -> float:
    return float(np.interp(tick, [30, 47, 64], [0.0, 0.6, 0.85]))


def tip_m(tick: int) -> NDArray[np.float64]:
    sideways = 0.008 * np.interp(tick, [51, 64], [0.0, 1.0])
    above = np.interp(tick, [0, 18], [0.055, 0.0])
    return GRASP_M + np.array([sideways, -sideways, above + lift_m(tick)])


def tissue(tick: int) -> TissueState:
    nodes, _ = box()
    scene = scenario().scene
    assert scene is not None
    distance = np.linalg.norm(nodes[:, :2] - GRASP_M[:2], axis=1)
    bump = np.exp(-((distance / 0.024) ** 2))
    for disc in scene.discs:
        gap = np.linalg.norm(nodes[:, :2] - disc.center_m, axis=1) - disc.radius_m
        bump = bump * np.clip(gap / 0.02, 0.0, 1.0)
    bump = bump / bump.max()
    moved = nodes + bump[:, None] * (tip_m(tick) - tip_m(18)) * (tick > 18)
    steep = np.abs(np.gradient(bump)) + bump**6
    force = np.zeros_like(nodes)
    force[:, 2] = force_n(tick) * steep / steep.max()
    grasped = {"psm1": [1]} if tick > 22 else {}
    return let_alone(tick, moved, force, max_force_n=force_n(tick), grasped=grasped)


def robot(tick: int) -> RobotState:
    down = (1.0, 0.0, 0.0, 0.0)
    tips = {"psm1": tuple(tip_m(tick).tolist()), "psm2": (0.05, 0.1, 0.06)}
    arms = {
        name: ArmState(
            joints=STILL,
            joint_velocities=STILL,
            tip_in_world=Pose(position_m=tip, quaternion_xyzw=down),
            jaw_rad=1.0,
            setpoint_joints=STILL,
            setpoint_jaw_rad=1.0,
            operating_state="ENABLED",
        )
        for name, tip in tips.items()
    }
    goal = next((goal for goal in GOALS if tick <= goal[2]), GOALS[-1])
    ended = {"succeeded": "done", "interrupted": "interrupted"}[goal[3]]
    action = ActionState(
        goal_id=goal[0], name=goal[1], arm="psm1", block=BLOCK,
        phase=ended if tick == goal[2] else "lift",
    )  # fmt: skip
    return RobotState(
        tick=tick, arms=arms, action=action if tick else None, holds={}, verdict_tick=tick - 1
    )


def verdict(tick: int) -> Verdict:
    above = force_n(tick) > 0.5
    return Verdict(
        tick=tick,
        level="soft" if above else "ok",
        ok=not above,
        reason="force_soft" if above else "",
        max_force_n=force_n(tick),
        limit_n=0.5,
        hard_limit_n=1.0,
        visibility=visibility(tick),
        visible=visibility(tick) > 0.7,
        max_height=["psm1"] if above else [],
        force_rate_n_s=0.0,
        crossing_tick=-1,
        max_node_speed_m_s=0.0,
        grasped={"psm1": 1} if tick > 22 else {},
    )


def plan(tick: int, reason: str, names: tuple[str, ...]) -> Plan:
    actions = [
        PlannedAction(
            t=t, text=f"{name}(psm1,{BLOCK})", name=name, args=["psm1", BLOCK], expected=[]
        )
        for t, name in enumerate(names, start=1)
    ]
    return Plan(
        tick=tick,
        request_id=f"c{tick}",
        reason=reason,
        criterion="weighted",
        goal="visible",
        asp_digest="",
        ignore_ap=False,
        tried=[],
        actions=actions,
        target=BLOCK if actions else "",
        arm="psm1" if actions else "",
        history=[],
        cost=[12],
        models=2,
        ground_s=0.0011,
        solve_s=0.0008,
        explanation=[f"{BLOCK} is the farthest from every attachment point that psm1 reaches."],
        no_plan=None,
    )


EMPTY_STATUS = TaskStatus(
    phase="resetting", action="", goal_id="", tried=[], plans=0, replans=0, scenario_kind="A",
    actions=[], outcome="", reason="",
    violations=[],
)  # fmt: skip


def write_beginning(log: LogWriter) -> None:
    """Everything before the first tick: the request 1.5 s ago, the tissue at rest."""
    request = TaskRequest(
        command="start", trial=TRIAL, scenario=scenario(), started_ns=START_NS - 1_500_000_000
    )
    mirror = RpcRecord(
        key="planner/task",
        request=msgspec.Raw(encode(request)),
        reply=msgspec.Raw(encode(TaskReply(accepted=True, reason=""))),
        fault=None,
        duration_s=0.01,
    )
    log.put("planner/task_status", EMPTY_STATUS)
    log.put("rpc/planner/task", mirror)
    log.put("health/sim", health(), trial="")
    log.put("sim/tissue_model", model())


def health() -> Health:
    return Health(
        service="sim", state="ready", rss_bytes=1, cpu_percent=1.0, received=1, published=1,
        malformed=0, refused=0, wrong_trial=0, queue_depth=0, queue_dropped=0, gaps=0,
        facts={"linear_solver": "block tridiagonal"}, refusals={},
    )  # fmt: skip


def write_ticks(log: LogWriter, first: int, last: int) -> None:
    for tick in range(first, last + 1):
        log.now_ns += TICK_NS
        log.put("robot/state", robot(tick))
        log.put("sim/tissue_state", tissue(tick))
        log.put("sa/verdict", verdict(tick))


def write_trial(log: LogWriter) -> None:
    """The whole story, planning pauses of 50 ms included."""
    write_beginning(log)
    write_ticks(log, 0, 0)
    status = msgspec.structs.replace(EMPTY_STATUS, phase="planning")
    tick, goals = 0, iter(GOALS)
    for number, (reason, names) in enumerate(
        [("initial", ("reach", "grasp", "pull")), ("force", ("move",)), ("exposure", ())]
    ):
        log.now_ns += 50_000_000
        made = plan(tick, reason, names)
        log.put("planner/plan", made)
        status = msgspec.structs.replace(
            status,
            plans=number + 1,
            replans=min(number, 1),
            scenario_kind="B" if number else "A",
        )
        for action, (goal_id, name, last, outcome, why) in zip(made.actions, goals, strict=False):
            status = msgspec.structs.replace(
                status, phase="acting", action=action.text, goal_id=goal_id
            )
            log.put("planner/task_status", status)
            write_ticks(log, tick + 1, last)
            tick = last
            result = ActionResult(
                tick=tick, goal_id=goal_id, name=name, arm="psm1", block=BLOCK,
                outcome=outcome, reason=why,
            )  # fmt: skip
            log.put("motion/action_result", result)
            status = msgspec.structs.replace(status, actions=[*status.actions, action.text])
            log.put("planner/task_status", status)
    ended = msgspec.structs.replace(
        status, phase="ended", action="", goal_id="", outcome="success",
        reason="the region of interest is visible",
    )  # fmt: skip
    log.put("log/sa", LogRecord(level="warning", event="late", fields={"tick": "12"}))
    log.put("planner/task_status", ended)


@pytest.fixture(scope="session")
def log_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a whole trial; tests copy it before they change it."""
    path = tmp_path_factory.mktemp("report") / "audit.mcap"
    log = open_log(path)
    write_trial(log)
    log.file.close({"reason": "closed"})
    return path


@pytest.fixture(scope="session")
def story() -> ModuleType:
    """This module: what the log above is made of, for tests that make their own."""
    return sys.modules[__name__]


@pytest.fixture
def new_log(tmp_path: Path) -> Callable[..., LogWriter]:
    """An open log at `tmp_path/audit.mcap` that a test fills itself."""
    return lambda **options: open_log(tmp_path / "audit.mcap", **options)
