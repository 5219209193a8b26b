"""What a viewer is shown, before any file format: instruments, blocks, colours, odd messages."""

import math

import msgspec
import numpy as np
import pytest
from tests.cli.report import conftest as made
from tests.log.conftest import CONTEXT

from fras_common.codec import encode
from fras_common.messages import ActionResult, ArmState, Array, Header, NoPlan, Pose
from fras_log.anchors import vertex_normals
from fras_log.colours import FORCE_STOPS, force_rgb, rgb
from fras_log.export.facts import Arms, Blocks, Fact, Gauges, Sentence, Stage, Tissue
from fras_log.export.instruments import BLADE_M, instrument
from fras_log.export.teller import Teller
from fras_log.reader import RawMessage
from fras_motion.kinematics import BASES_IN_WORLD, ArmKinematics


def tell(teller: Teller, key: str, message: Header, trial: str = made.TRIAL) -> list[Fact]:
    """Hand a message over as the reader does: published at 7 ns, arrived at 9 ns."""
    stamped = msgspec.structs.replace(message, trial=trial, stamp_ns=7, source="sa/1")
    return teller.tell(RawMessage(key, encode(stamped), 9))


@pytest.fixture
def teller() -> Teller:
    return Teller(made.TRIAL, made.scenario())


@pytest.mark.parametrize("name", BASES_IN_WORLD)
def test_the_joints_tell_where_wrist_and_remote_centre_are(name: str) -> None:
    base = BASES_IN_WORLD[name]
    kinematics = ArmKinematics(base)
    rng = np.random.default_rng(3)
    for _ in range(50):
        low, high = [-1.0, -0.6, 0.1, -2.0, -1.2, -1.2], [1.0, 0.6, 0.2, 2.0, 1.2, 1.2]
        yaw, pitch, insertion, roll, wrist_pitch, wrist_yaw = rng.uniform(low, high).tolist()
        joints = (yaw, pitch, insertion, roll, wrist_pitch, wrist_yaw)
        tip = kinematics.forward(joints)
        arm = ArmState(
            joints=joints,
            joint_velocities=made.STILL,
            tip_in_world=Pose(position_m=tip.position_m, quaternion_xyzw=tip.quaternion_xyzw),
            jaw_rad=0.8,
            setpoint_joints=joints,
            setpoint_jaw_rad=0.8,
            operating_state="ENABLED",
        )
        drawn = instrument(arm)
        np.testing.assert_allclose(drawn.remote_centre_m, base.position_m, atol=1e-12)
        np.testing.assert_allclose(drawn.wrist_m, kinematics.joint_origins(joints)[4], atol=1e-12)
        apart = math.dist(*drawn.blades_m)
        assert apart == pytest.approx(2.0 * BLADE_M * math.sin(0.4))


def test_a_closed_jaw_is_drawn_as_one_blade_that_ends_at_the_tip() -> None:
    arm = msgspec.structs.replace(made.robot(3).arms["psm1"], jaw_rad=-0.35)
    drawn = instrument(arm)
    for end in drawn.blades_m:
        np.testing.assert_allclose(end, arm.tip_in_world.position_m, atol=1e-12)


def test_colours_run_from_the_first_stop_to_the_last_and_stay_there() -> None:
    forces_n = np.array([0.0, 0.04, 1.0, 5.0, math.nan])
    assert [tuple(colour) for colour in force_rgb(forces_n, 1.0).tolist()] == [
        rgb(FORCE_STOPS[0]),
        rgb(FORCE_STOPS[1]),
        rgb(FORCE_STOPS[-1]),
        rgb(FORCE_STOPS[-1]),
        rgb(FORCE_STOPS[0]),
    ]


def test_normals_of_nodes_point_out_of_the_box() -> None:
    nodes, _ = made.box()
    normals = vertex_normals(nodes, made.model().surface.ints())
    size = np.array(made.scenario().tissue.size_m)
    outwards = np.einsum("nx,nx->n", normals, nodes - size / 2.0)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    assert (outwards > 0.0).all()
    inside_top = (nodes[:, 2] == size[2]) & (np.abs(nodes[:, :2] / size[:2] - 0.5) < 0.4).all(1)
    assert inside_top.sum() > 100
    np.testing.assert_allclose(normals[inside_top], np.tile([0.0, 0.0, 1.0], (inside_top.sum(), 1)))


def test_blocks_lie_at_the_centres_of_their_cells_and_follow_the_tissue(teller: Teller) -> None:
    tell(teller, "sa/context", CONTEXT)
    tell(teller, "sim/tissue_model", made.model())
    for tick in (0, made.LAST_TICK):
        state = made.tissue(tick)
        (blocks,) = [f for f in tell(teller, "sim/tissue_state", state) if isinstance(f, Blocks)]
        assert blocks.names == tuple(CONTEXT.names)
        for rest_m, place_m in zip(CONTEXT.blocks_m, blocks.places_m, strict=True):
            nearest = np.argsort(np.linalg.norm(made.box()[0] - rest_m, axis=1))[:4]
            moved_m = state.nodes_m.floats()[nearest] - made.box()[0][nearest]
            low, high = moved_m.min(axis=0) - 3e-3, moved_m.max(axis=0) + 3e-3
            assert ((place_m - rest_m >= low) & (place_m - rest_m <= high)).all()
            if tick == 0:
                np.testing.assert_allclose(place_m, rest_m, atol=1e-7)
    assert blocks.places_m[:, 2].max() > 0.02


def test_a_block_is_held_only_while_nodes_are(teller: Teller) -> None:
    tell(teller, "sa/context", CONTEXT)
    tell(teller, "sim/tissue_model", made.model())
    kinds: list[str] = []
    for tick, grasped in ((20, {}), (23, {"psm1": [4]}), (24, {"psm1": []})):
        tell(teller, "robot/state", made.robot(tick))
        state = msgspec.structs.replace(made.tissue(tick), grasped=grasped)
        (blocks,) = [f for f in tell(teller, "sim/tissue_state", state) if isinstance(f, Blocks)]
        kinds.append(dict(zip(blocks.names, blocks.kinds, strict=True))[made.BLOCK])
    assert kinds == ["fixed", "held", "fixed"]


def test_blocks_without_places_are_counted_and_not_shown(teller: Teller) -> None:
    tell(teller, "sim/tissue_model", made.model())
    tell(teller, "sa/context", msgspec.structs.replace(CONTEXT, blocks_m=CONTEXT.blocks_m[:-1]))
    assert teller.malformed == 1
    facts = tell(teller, "sim/tissue_state", made.tissue(0))
    assert [type(fact) for fact in facts] == [Tissue]


def test_messages_of_another_trial_show_nothing(teller: Teller) -> None:
    assert tell(teller, "sim/tissue_model", made.model(), trial="t-6") == []
    assert (teller.known, teller.malformed, teller.tick) == (1, 0, -1)


def test_a_tissue_that_does_not_fit_its_model_is_counted_and_left_out(teller: Teller) -> None:
    assert tell(teller, "sim/tissue_state", made.tissue(0)) == []
    assert teller.malformed == 0
    (stage,) = tell(teller, "sim/tissue_model", made.model())
    assert isinstance(stage, Stage)
    short = Array.of(np.zeros((5, 3)), "<f4")
    state = msgspec.structs.replace(made.tissue(1), nodes_m=short, nodal_force_n=short)
    assert tell(teller, "sim/tissue_state", state) == []
    state = msgspec.structs.replace(made.tissue(1), nodal_force_n=short)
    assert tell(teller, "sim/tissue_state", state) == []
    model = made.model()
    beyond = Array.of(model.surface.ints() + 1_000_000, "<i4")
    assert tell(teller, "sim/tissue_model", msgspec.structs.replace(model, surface=beyond)) == []
    assert teller.malformed == 3
    (tissue, *_) = tell(teller, "sim/tissue_state", made.tissue(2))
    assert isinstance(tissue, Tissue)
    assert (tissue.moment.tick, tissue.moment.stamp_ns, tissue.moment.arrival_ns) == (2, 7, 9)


def test_times_of_a_tick_that_was_not_recorded_are_not_made_up(teller: Teller) -> None:
    tell(teller, "robot/state", made.robot(1))
    tell(teller, "robot/state", made.robot(3))
    (gauges,) = tell(teller, "sa/verdict", made.verdict(3))
    assert isinstance(gauges, Gauges)
    assert math.isnan(gauges.tick_ms)
    assert math.isnan(gauges.solve_ms)


def test_a_plan_that_does_not_exist_says_why(teller: Teller) -> None:
    none = NoPlan(core=["fixed"], sentences=["Every block in reach is attached."])
    plan = msgspec.structs.replace(made.plan(0, "initial", ()), no_plan=none, explanation=[])
    said = [fact for fact in tell(teller, "planner/plan", plan) if isinstance(fact, Sentence)]
    assert [(one.level, one.text) for one in said] == [
        ("info", "plan 1 (initial, weighted): no plan"),
        ("warning", "Every block in reach is attached."),
    ]


def test_an_action_without_a_block_is_told_without_one(teller: Teller) -> None:
    result = ActionResult(
        tick=4, goal_id="g4", name="release", arm="psm1", block="", outcome="succeeded", reason=""
    )
    (said,) = tell(teller, "motion/action_result", result)
    assert isinstance(said, Sentence)
    assert said.text == "release(psm1) succeeded"


def test_what_was_broken_is_said_as_an_error(teller: Teller) -> None:
    status = msgspec.structs.replace(
        made.EMPTY_STATUS,
        phase="ended",
        outcome="failed",
        reason="replans",
        violations=["It pulled on an attached block."],
    )
    said = tell(teller, "planner/task_status", status)
    assert [(one.level, one.text) for one in said if isinstance(one, Sentence)] == [
        ("warning", "failed: replans"),
        ("error", "It pulled on an attached block."),
    ]


def test_what_belongs_to_no_tick_stands_at_the_latest(teller: Teller) -> None:
    tell(teller, "robot/state", made.robot(5))
    status = msgspec.structs.replace(made.EMPTY_STATUS, phase="ended", outcome="success")
    (said,) = tell(teller, "planner/task_status", status)
    assert said.moment.tick == 5


def test_both_arms_are_told(teller: Teller) -> None:
    (arms,) = tell(teller, "robot/state", made.robot(4))
    assert isinstance(arms, Arms)
    assert list(arms.instruments) == ["psm1", "psm2"]


def test_of_a_patient_beside_its_model_nothing_is_drawn(teller: Teller) -> None:
    assert len(tell(teller, "sim/tissue_model", made.model())) == 1
    assert tell(teller, "patient/tissue_model", made.model()) == []
    assert tell(teller, "patient/tissue_state", made.tissue(9)) == []
    assert teller.malformed == 0
    (shown,) = tell(teller, "sim/tissue_state", made.tissue(9))
    assert isinstance(shown, Tissue)
