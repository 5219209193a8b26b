"""The file for Rerun against the log that it is made from, read by Rerun."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rerun.chunk import RrdReader
from tests.cli.report import conftest as made
from tests.log.conftest import UNDER_WAY_NS

from fras_log.colours import force_rgb
from support.exported import columns_of, read_rerun, run_rerun
from support.logs import messages

PEAK = 47
TICKS = made.LAST_TICK + 1
MOVING = {
    "/world/tissue": TICKS,
    "/world/above_limit": TICKS,
    "/world/psm1": TICKS,
    "/world/psm1_tip": TICKS,
    "/world/psm2": TICKS,
    "/world/psm2_tip": TICKS,
    "/world/blocks": TICKS + 3,
    "/world/grasp": TICKS + 3,
    "/force/measured": TICKS,
    "/force/limit": TICKS,
    "/force/hard_limit": TICKS,
    "/visibility/measured": TICKS,
    "/visibility/threshold": TICKS,
    "/time/tick_ms": TICKS,
    "/time/solve_ms": TICKS,
    "/log": 12,
}
STAYING = ("/world/attachments", "/world/roi", "/world/roi/to_clear", "/world/scale")


@pytest.fixture(scope="module")
def read(rerun_file: Path) -> tuple[dict[str, dict[str, list[Any]]], dict[str, dict[str, Any]]]:
    return read_rerun(rerun_file)


def packed(colours: Any) -> list[int]:
    red, green, blue = np.asarray(colours, dtype=np.uint32).T
    return (red << 24 | green << 16 | blue << 8 | 0xFF).tolist()


def test_reruns_own_checker_finds_nothing(rerun_file: Path, tmp_path: Path) -> None:
    done = run_rerun(tmp_path, "rrd", "verify", str(rerun_file))
    assert done.returncode == 0, done.stderr
    assert "verified without error" in done.stdout + done.stderr
    told = run_rerun(tmp_path, "rrd", "stats", str(rerun_file))
    assert told.returncode == 0, told.stderr
    entities = {line.partition(":")[0] for line in told.stdout.splitlines() if line[:1] == "/"}
    assert {*MOVING, *STAYING} <= entities


def test_a_damaged_file_would_have_been_found(rerun_file: Path, tmp_path: Path) -> None:
    broken = bytearray(rerun_file.read_bytes())
    broken[len(broken) // 2] ^= 0xFF
    path = tmp_path / "broken.rrd"
    path.write_bytes(bytes(broken[: len(broken) - 4000]))
    assert run_rerun(tmp_path, "rrd", "verify", str(path)).returncode != 0


def test_each_message_of_the_source_has_a_row_and_its_times(read: Any, trial_log: Path) -> None:
    moving, staying = read
    assert {path: len(columns["tick"]) for path, columns in moving.items()} == MOVING
    assert set(STAYING) <= set(staying)
    for path, key in {"/world/tissue": "sim/tissue_state", "/force/measured": "sa/verdict"}.items():
        columns = moving[path]
        sent = messages(trial_log, key, with_garbage=True)
        assert columns["tick"] == [message.tick for message in sent]
        assert columns["published"] == [message.stamp_ns for message in sent]
        assert columns["arrived"] == [message.stamp_ns + UNDER_WAY_NS for message in sent]
        assert columns["simulated"] == [100_000_000 * message.tick for message in sent]


def test_faces_are_there_once_and_the_surface_moves_with_the_state(
    read: Any, trial_log: Path
) -> None:
    moving, staying = read
    (model,) = messages(trial_log, "sim/tissue_model")
    state = messages(trial_log, "sim/tissue_state", with_garbage=True)[PEAK]
    faces = staying["/world/tissue"]["Mesh3D:triangle_indices"]
    np.testing.assert_array_equal(faces, model.surface.view())
    tissue = moving["/world/tissue"]
    np.testing.assert_array_equal(tissue["Mesh3D:vertex_positions"][PEAK], state.nodes_m.view())
    force_n = np.linalg.norm(state.nodal_force_n.floats(), axis=1)
    assert tissue["Mesh3D:vertex_colors"][PEAK] == packed(force_rgb(force_n, 1.0))
    above = moving["/world/above_limit"]["Points3D:positions"]
    assert [tick for tick, places in enumerate(above) if places] == [46, 47, 48]
    np.testing.assert_array_equal(above[PEAK], state.nodes_m.view()[force_n > 0.5])


def test_the_frames_are_the_tips(read: Any, trial_log: Path) -> None:
    moving, _ = read
    for state in messages(trial_log, "robot/state"):
        for name, arm in state.arms.items():
            tip = moving[f"/world/{name}_tip"]
            (place,) = tip["Transform3D:translation"][state.tick]
            (turn,) = tip["Transform3D:quaternion"][state.tick]
            np.testing.assert_array_equal(place, np.float32(arm.tip_in_world.position_m))
            np.testing.assert_array_equal(turn, np.float32(arm.tip_in_world.quaternion_xyzw))


def test_numbers_and_words_are_those_of_the_trial(read: Any, trial_log: Path) -> None:
    moving, _ = read
    verdicts = messages(trial_log, "sa/verdict")
    force = [value for (value,) in moving["/force/measured"]["Scalars:scalars"]]
    assert force == [verdict.max_force_n for verdict in verdicts]
    seen = [value for (value,) in moving["/visibility/measured"]["Scalars:scalars"]]
    assert seen == [verdict.visibility for verdict in verdicts]
    said = [text for (text,) in moving["/log"]["TextLog:text"]]
    reasons = [
        f"planner: {text}"
        for plan in messages(trial_log, "planner/plan")
        for text in plan.explanation
    ]
    assert [text for text in said if text in reasons] == reasons
    levels = dict(zip(said, (level for (level,) in moving["/log"]["TextLog:level"]), strict=True))
    assert levels["motion: pull(psm1,b(4,4)) interrupted: force_soft"] == "WARN"


def test_the_block_that_is_grasped_is_named(read: Any) -> None:
    moving, _ = read
    named = [labels or [] for labels in moving["/world/grasp"]["Points3D:labels"]]
    assert named[:2] == [[], ["b(4,4) chosen"]]
    assert named[-1] == ["b(4,4) held"]
    assert [len(places) for places in moving["/world/blocks"]["Points3D:positions"]] == [49] * (
        TICKS + 3
    )


def test_it_opens_with_views_of_its_own(rerun_file: Path) -> None:
    reader = RrdReader(rerun_file)
    (views,) = reader.blueprints()
    kinds: list[str] = []
    for chunk in reader.stream(store=views).to_chunks():
        named = columns_of(chunk).get("ViewBlueprint:class_identifier", [])
        kinds += [kind for (kind,) in named]
    assert sorted(kinds) == ["3D", "TextLog", "TimeSeries", "TimeSeries", "TimeSeries"]
