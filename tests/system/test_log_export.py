"""A real trial, exported, against what the services themselves said."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fras_log.export import Format, export
from fras_motion.kinematics import BASES_IN_WORLD
from support.exported import parse_publicly, points, read_foxglove, read_rerun, run_rerun
from support.logs import messages


@pytest.fixture(scope="module")
def log(trials: Any) -> Path:
    _, log = trials.run("b")
    return log


@pytest.fixture(scope="module")
def outputs(log: Path) -> dict[Format, Path]:
    paths = {kind: log.with_name(f"exported{kind}") for kind in Format}
    done = export(log, paths)
    assert (done.malformed, done.damage) == (0, "")
    assert done.last_tick == messages(log, "robot/state")[-1].tick
    return paths


def test_foxglove_holds_every_tick_in_public_schemas(
    log: Path, outputs: dict[Format, Path]
) -> None:
    read = read_foxglove(outputs[Format.FOXGLOVE])
    for topic in set(read) - {"/gauges"}:
        for message in read[topic]:
            parse_publicly(message)
    for topic, key in {"/tissue": "sim/tissue_state", "/tools": "robot/state"}.items():
        assert len(read[topic]) == len(messages(log, key))
    forces = [one.content.force_n for one in read["/gauges"]]
    assert forces == [verdict.max_force_n for verdict in messages(log, "sa/verdict")]
    said = [one.content.message for one in read["/log"] if one.content.name == "planner"]
    reasons = [text for plan in messages(log, "planner/plan") for text in plan.explanation]
    assert [text for text in said if not text.startswith("plan ")] == reasons
    assert len(reasons) > 3


def test_blocks_are_where_situation_awareness_has_them(
    log: Path, outputs: dict[Format, Path]
) -> None:
    """At rest at first, and later as far from a tip as the evidence of `at(arm,block)` says."""
    shown = read_foxglove(outputs[Format.FOXGLOVE])["/blocks"]
    robot = {state.tick: state for state in messages(log, "robot/state")}
    contexts, checked = messages(log, "sa/context"), 0
    for context in contexts:
        (at,) = [one for one in shown if one.publish_time_ns == context.stamp_ns]
        (blocks,) = at.content.entities
        places = points(sphere.pose.position for sphere in blocks.spheres)
        if context.tick == 0:
            np.testing.assert_allclose(places, context.blocks_m, atol=1e-7)
        for fluent, evidence in context.evidence.items():
            if fluent.startswith("at("):
                arm, block = fluent.removeprefix("at(").removesuffix(")").split(",", 1)
                tip_m = robot[context.tick].arms[arm].tip_in_world.position_m
                distance_m = np.linalg.norm(np.subtract(places[context.names.index(block)], tip_m))
                assert distance_m == pytest.approx(evidence["distance_m"], abs=1e-7)
                checked += context.tick > 0
    assert checked > 0


def test_shafts_pass_through_the_remote_centres(log: Path, outputs: dict[Format, Path]) -> None:
    for one in read_foxglove(outputs[Format.FOXGLOVE])["/tools"]:
        for tool in one.content.entities:
            (centre, *_) = points(tool.lines[0].points)
            np.testing.assert_allclose(centre, BASES_IN_WORLD[tool.id].position_m, atol=1e-9)


def test_rerun_opens_it(log: Path, outputs: dict[Format, Path], tmp_path: Path) -> None:
    path = outputs[Format.RERUN]
    done = run_rerun(tmp_path, "rrd", "verify", str(path))
    assert done.returncode == 0, done.stderr
    moving, _ = read_rerun(path)
    states = messages(log, "sim/tissue_state")
    tissue = moving["/world/tissue"]
    assert tissue["tick"] == [state.tick for state in states]
    assert tissue["published"] == [state.stamp_ns for state in states]
    last = tissue["Mesh3D:vertex_positions"][-1]
    np.testing.assert_array_equal(last, states[-1].nodes_m.view())
    named = [labels for labels in moving["/world/grasp"]["Points3D:labels"] if labels]
    grasped = next(plan for plan in messages(log, "planner/plan") if plan.target).target
    assert named[0] == [f"{grasped} chosen"]
    assert named[-1] == [f"{grasped} held"]


def test_rerun_finds_nothing_wrong_with_the_other_file_either(
    outputs: dict[Format, Path], tmp_path: Path
) -> None:
    done = run_rerun(tmp_path, "mcap", "check", "--full", str(outputs[Format.FOXGLOVE]))
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("ok ") == 7, done.stdout
