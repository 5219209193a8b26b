"""The simulator's shell on an in-memory bus: one state in, one out, idempotent, never guessing."""

from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np
import pytest
from structlog.testing import capture_logs

from fras_common.bus import RemoteFault
from fras_common.codec import content_digest
from fras_common.messages import (
    FaultRecord,
    Header,
    ResetRequest,
    SimCheckpoint,
    TissueModel,
    TissueState,
)
from fras_common.scenario import Disc, Scenario, SceneSection, TissueSection
from fras_common.service.rates import TOLD_AT_ONCE
from fras_common.topics import (
    FAULT,
    ROBOT_STATE,
    SIM_CHECKPOINT,
    SIM_RESET,
    TISSUE_MODEL,
    TISSUE_STATE,
)
from fras_sim.adapter import build_simulator, checkpoint_of, tissue_state, tools_of
from fras_sim.fem import FactorizationFailed, TissueSimulator
from fras_sim.service import SimService
from support.robots import robot
from support.shells import ShellBench

SCENE = SceneSection(roi_m=(0.05, 0.06, 0.0), discs=(Disc(center_m=(0.02, 0.09), radius_m=0.02),))
SMALL = TissueSection(node_counts=(6, 7, 2))


class Bench(ShellBench):
    """The simulator, and a client that plays the robot."""

    def __init__(self) -> None:
        super().__init__("sim", SimService, client="motion/test")
        self.models: list[TissueModel] = self.heard(TISSUE_MODEL)
        self.states: list[TissueState] = self.heard(TISSUE_STATE)
        self.robot = self.client.publisher(ROBOT_STATE)

    def put(self, *arguments: Any, **options: Any) -> None:
        self.robot.put(robot(*arguments, **options))
        self.settle()

    def reset(self, trial: str = "t", scenario: Scenario | None = None) -> None:
        request = ResetRequest(
            trial=trial, scenario=scenario or Scenario(tissue=SMALL, scene=SCENE)
        )
        answer = self.answer(SIM_RESET, request)
        assert answer.digest == content_digest(trial, request.scenario, b"")


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


def test_reset_publishes_the_tissue_at_rest(bench: Bench) -> None:
    bench.reset()
    (model,) = bench.models
    assert model.nodes_m.shape == (84, 3)
    assert model.roi_m == SCENE.roi_m
    fixed = model.nodes_m.floats()[model.fixed_nodes.ints()]
    assert len(fixed) > 0
    assert (np.hypot(fixed[:, 0] - 0.02, fixed[:, 1] - 0.09) <= 0.02).all()
    assert len(model.fixed_points_m.floats()) > len(fixed)
    assert bench.host.facts["linear_solver"] == "scipy-single"


def test_state_that_overtakes_the_reset_is_answered_after_it(bench: Bench) -> None:
    bench.put(0)
    assert bench.states == []
    bench.reset()
    assert [state.tick for state in bench.states] == [0]
    assert bench.states[0].max_force_n < 1e-12


def test_each_tick_once_in_order_and_the_same_answer_again(bench: Bench) -> None:
    bench.reset()
    bench.put(0)
    bench.put(1, (0.05, 0.03, 0.055), 60.0)
    bench.put(1, (0.05, 0.03, 0.055), 60.0)
    assert [state.tick for state in bench.states] == [0, 1, 1]
    first, second = bench.states[1:]
    assert first.nodes_m == second.nodes_m
    assert second.seq == first.seq + 1
    bench.put(5)
    assert len(bench.states) == 3
    assert bench.host.counts["gaps"] >= 1


def test_ticks_out_of_order_are_all_counted_and_few_are_logged(bench: Bench) -> None:
    bench.reset()
    bench.host.clock = lambda: 0.0
    with capture_logs() as logs:
        for _ in range(TOLD_AT_ONCE + 50):
            bench.put(7)
    assert bench.host.counts["gaps"] == TOLD_AT_ONCE + 50
    assert [log["event"] for log in logs] == ["tick out of order, not stepped"] * TOLD_AT_ONCE


def test_state_of_another_trial_is_no_tick(bench: Bench) -> None:
    bench.reset()
    bench.put(0, trial="yesterday")
    assert bench.states == []
    bench.reset("t2")
    assert bench.host.gate.dropped == 1


def test_grasp_follows_the_tool_and_is_reported(bench: Bench) -> None:
    bench.reset()
    top = bench.models[0].nodes_m.floats()[-1]
    tip = (float(top[0]), float(top[1]), float(top[2]))
    bench.put(0, (tip[0], tip[1], 0.02))
    bench.put(1, tip, 60.0)
    bench.put(2, tip, -20.0)
    assert bench.states[-1].grasped["psm1"]
    bench.put(3, (tip[0], tip[1], tip[2] + 0.002), -20.0)
    state = bench.states[-1]
    held = state.nodes_m.floats()[state.grasped["psm1"]]
    assert held[:, 2].max() > 0.0065
    assert state.max_force_n > 0
    assert state.tool_force_n["psm1"][2] > 0


@pytest.mark.parametrize(
    ("tip", "named"),
    [((float("nan"), 0.03, 0.05), "position_m"), ((0.05, 0.03, 0.2), "jump_m")],
)
def test_bad_tool_pose_is_a_typed_fault_and_the_tissue_unchanged(
    bench: Bench, tip: Any, named: str
) -> None:
    faults: list[FaultRecord] = bench.heard(FAULT)
    bench.reset()
    bench.put(0)
    with capture_logs() as logs:
        bench.put(1, tip)
    assert len(bench.states) == 1
    assert [entry["event"] for entry in logs] == ["message refused"]
    (fault,) = faults
    assert (fault.kind, fault.key, fault.tick) == ("BadToolInput", ROBOT_STATE.key, 1)
    assert fault.trial == "t"
    assert "psm1" in fault.text
    assert {"arm", named} <= set(fault.values)
    assert bench.host.counts["refused"] == 1
    bench.put(1)
    assert bench.states[-1].tick == 1


def test_forces_are_published_by_node_patch_and_tool_and_balance(bench: Bench) -> None:
    bench.reset()
    corner = bench.models[0].nodes_m.floats()[-1]
    tip = (float(corner[0]), float(corner[1]), float(corner[2]))
    model = bench.models[0]
    assert model.fixed_patch.shape == model.fixed_nodes.shape
    for tick in range(12):
        at = (tip[0], tip[1], tip[2] + 0.001 * max(0, tick - 2))
        bench.put(tick, at, 60.0 if tick < 2 else -20.0)
    state = bench.states[-1]
    share = np.array(state.grasped_force_n["psm1"])
    assert share.shape == (len(state.grasped["psm1"]), 3)
    np.testing.assert_allclose(share.sum(axis=0), state.tool_force_n["psm1"], atol=1e-12)
    assert state.patch_force_n.shape == (model.fixed_patch.ints().max() + 1, 3)
    assert state.tool_force_n["psm1"][2] > 1e-3
    nodal = state.nodal_force_n.floats()
    on_patch = nodal[model.fixed_nodes.ints()].sum(axis=0)
    # Attachments bear the elastic force of their nodes, and viscosity.
    assert np.linalg.norm(state.patch_force_n.floats().sum(axis=0) - on_patch) < 1e-3
    assert np.abs(state.patch_force_n.floats()).max() > 1e-5
    assert 0.0 < state.balance_residual_n < 0.02 * state.max_force_n + 1e-4


def test_a_checkpoint_and_the_robot_after_it_give_the_same_tissue_again(bench: Bench) -> None:
    checkpoints: list[SimCheckpoint] = bench.heard(SIM_CHECKPOINT)
    bench.reset()
    corner = bench.models[0].nodes_m.floats()[-1]
    robots = [
        robot(
            tick,
            (float(corner[0]), float(corner[1]), float(corner[2]) + 0.001 * max(0, tick - 2)),
            60.0 if tick < 2 else -20.0,
        )
        for tick in range(27)
    ]
    for state in robots:
        bench.robot.put(state)
        bench.settle()
    assert [checkpoint.tick for checkpoint in checkpoints] == [10, 20]
    # As it travels: encoded and decoded.
    message = msgspec.msgpack.decode(msgspec.msgpack.encode(checkpoints[-1]), type=SimCheckpoint)
    fresh = build_simulator(Scenario(tissue=SMALL, scene=SCENE))
    fresh.restore(checkpoint_of(message))
    for state in robots[21:]:
        result = fresh.step(tools_of(state))
        published = bench.states[state.tick]
        again = tissue_state(result, state.tick, "t", published.solver.wall_s)
        assert msgspec.structs.replace(again, **header_of(published)) == published


def header_of(message: Header) -> dict[str, Any]:
    return {name: getattr(message, name) for name in ("stamp_ns", "seq", "source")}


def test_reset_recovers_and_leaves_no_trace(bench: Bench) -> None:
    def trial(name: str) -> list[TissueState]:
        bench.states.clear()
        bench.reset(name)
        for tick in range(6):
            bench.put(
                tick, (0.0, 0.0, 0.005 + 0.001 * tick), 60.0 if tick < 2 else -20.0, trial=name
            )
        return [*bench.states]

    first, second = trial("t1"), trial("t2")
    assert len(first) == 6
    assert [state.nodes_m for state in first] == [state.nodes_m for state in second]


def test_scenario_without_a_scene_is_a_typed_fault(bench: Bench) -> None:
    with pytest.raises(RemoteFault, match="UnresolvedScenario"):
        bench.reset(scenario=Scenario(tissue=SMALL))


def test_step_that_fails_is_answered_with_the_state_kept(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise FactorizationFailed("row 3", row=3)

    bench.reset()
    bench.put(0)
    with monkeypatch.context() as patch:
        patch.setattr(TissueSimulator, "step", fail)
        bench.put(1)
    assert [state.tick for state in bench.states] == [0, 1]
    assert not bench.states[-1].solver.converged
    assert bench.states[-1].nodes_m == bench.states[0].nodes_m
    bench.reset("t2")
    bench.put(0, trial="t2")
    bench.put(1, trial="t2")
    assert bench.states[-1].solver.converged
