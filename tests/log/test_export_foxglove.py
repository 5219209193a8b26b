"""The file for Foxglove against the log that it is made from, read by nothing of ours."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.Log_pb2 import Log
from mcap.reader import make_reader
from tests.cli.report import conftest as made

from fras_log.export import Format, export
from support.exported import Read, parse_publicly, points, read_foxglove
from support.logs import messages

SOURCES = {
    "/tissue": "sim/tissue_state",
    "/tf": "robot/state",
    "/tools": "robot/state",
    "/gauges": "sa/verdict",
    "/scene": "sim/tissue_model",
}
PEAK = 47
TOPICS = {*SOURCES, "/blocks", "/log"}


@pytest.fixture(scope="module")
def read(foxglove_file: Path) -> dict[str, list[Read]]:
    return read_foxglove(foxglove_file)


def source(log: Path, key: str) -> list[Any]:
    return messages(log, key, with_garbage=True)


def entity(update: Any, name: str) -> Any:
    (found,) = [entity for entity in update.entities if entity.id == name]
    return found


def test_every_message_is_one_of_the_public_schemas(read: dict[str, list[Read]]) -> None:
    assert set(read) == TOPICS
    for topic in TOPICS - {"/gauges"}:
        for message in read[topic]:
            assert parse_publicly(message).ByteSize() > 0


@pytest.mark.parametrize("topic", SOURCES)
def test_each_message_of_the_source_has_its_own_and_its_times(
    read: dict[str, list[Read]], trial_log: Path, topic: str
) -> None:
    expected: list[tuple[int, int, int]] = []
    with trial_log.open("rb") as stream:
        for _, _, message in make_reader(stream).iter_messages(topics=[SOURCES[topic]]):
            if message.data[:1] != b"\xc1":
                expected.append((message.log_time, message.publish_time, message.sequence))
    assert len(expected) == (1 if topic == "/scene" else made.LAST_TICK + 1)
    found = [(one.log_time_ns, one.publish_time_ns, one.sequence) for one in read[topic]]
    assert found == expected


def test_the_surface_is_that_of_the_state_coloured_by_force(
    read: dict[str, list[Read]], trial_log: Path
) -> None:
    state, message = source(trial_log, "sim/tissue_state")[PEAK], read["/tissue"][PEAK]
    (surface,) = entity(message.content, "tissue").triangles
    (model,) = source(trial_log, "sim/tissue_model")
    np.testing.assert_array_equal(points(surface.points), state.nodes_m.view())
    np.testing.assert_array_equal(np.reshape(surface.indices, (-1, 3)), model.surface.view())
    force_n = np.linalg.norm(state.nodal_force_n.view(), axis=1)
    colours = np.array([(c.r, c.g, c.b, c.a) for c in surface.colors])
    assert tuple(colours[force_n == 0.0][0]) == pytest.approx((248 / 255, 229 / 255, 217 / 255, 1))
    # Half of the hard limit of 1 N stands at the root of 1/2 of the scale, 3.54 of 5 intervals.
    near = colours[np.argmin(np.abs(force_n - 0.5))]
    between = 5 * np.sqrt(force_n[np.argmin(np.abs(force_n - 0.5))]) - 3
    low, high = np.array([0xD2, 0x42, 0x6F]), np.array([0x80, 0x25, 0x82])
    np.testing.assert_allclose(255 * near[:3], low + between * (high - low), atol=0.6)


def test_where_the_limit_is_crossed_is_marked(read: dict[str, list[Read]], trial_log: Path) -> None:
    for state, message in zip(source(trial_log, "sim/tissue_state"), read["/tissue"], strict=True):
        above = np.linalg.norm(state.nodal_force_n.floats(), axis=1) > 0.5
        marks = entity(message.content, "above_limit").spheres
        places = points(mark.pose.position for mark in marks)
        np.testing.assert_array_equal(np.reshape(places, (-1, 3)), state.nodes_m.view()[above])
        assert len(places) == (state.tick in (46, 47, 48)) * above.sum()
    assert any(entity(message.content, "above_limit").spheres for message in read["/tissue"])


def test_the_frames_are_the_tips(read: dict[str, list[Read]], trial_log: Path) -> None:
    for state, message in zip(source(trial_log, "robot/state"), read["/tf"], strict=True):
        frames = {frame.child_frame_id: frame for frame in message.content.transforms}
        assert set(frames) == {"psm1_tip", "psm2_tip"}
        for name, arm in state.arms.items():
            frame, turn = frames[f"{name}_tip"], frames[f"{name}_tip"].rotation
            assert frame.parent_frame_id == "world"
            assert points([frame.translation]) == [arm.tip_in_world.position_m]
            assert (turn.x, turn.y, turn.z, turn.w) == arm.tip_in_world.quaternion_xyzw
            assert frame.timestamp.ToNanoseconds() == state.stamp_ns


def test_a_tool_ends_at_its_tip_and_its_blades_are_as_far_apart_as_the_jaw_says(
    read: dict[str, list[Read]], trial_log: Path
) -> None:
    state, message = source(trial_log, "robot/state")[10], read["/tools"][10]
    jaws = np.array(points(entity(message.content, "psm1").lines[1].points))
    first, second = jaws[0] - jaws[1], jaws[2] - jaws[1]
    cosine = first @ second / np.linalg.norm(first) / np.linalg.norm(second)
    assert np.arccos(cosine) == pytest.approx(state.arms["psm1"].jaw_rad)
    tip = np.array(state.arms["psm1"].tip_in_world.position_m)
    middle = (first + second) / np.linalg.norm(first + second)
    np.testing.assert_allclose(jaws[1] + np.linalg.norm(first) * middle, tip, atol=1e-12)


def test_what_stays_is_there_once(read: dict[str, list[Read]], trial_log: Path) -> None:
    (model,) = source(trial_log, "sim/tissue_model")
    (message,) = read["/scene"]
    spheres = entity(message.content, "attachments").spheres
    places = points(sphere.pose.position for sphere in spheres)
    np.testing.assert_array_equal(places, model.fixed_points_m.view())
    roi = entity(message.content, "roi")
    assert points([roi.spheres[0].pose.position]) == [model.roi_m]
    ring = np.array(points(roi.lines[0].points)) - model.roi_m
    np.testing.assert_allclose(np.linalg.norm(ring, axis=1), 0.01)
    words = [text.text for text in entity(message.content, "scale").texts]
    assert words == ["0 N", "limit 0.50 N", "hard limit 1.00 N"]


def test_blocks_say_which_is_free_fixed_chosen_held(read: dict[str, list[Read]]) -> None:
    def colours(message: Read) -> dict[tuple[int, int, int], int]:
        shades = [sphere.color for sphere in entity(message.content, "blocks").spheres]
        found = [(round(255 * c.r), round(255 * c.g), round(255 * c.b)) for c in shades]
        return {shade: found.count(shade) for shade in found}

    free, fixed, chosen, held = (0x56, 0xB4, 0xE9), (59, 66, 82), (0xE6, 0x9F, 0), (0, 0x9E, 0x73)
    assert colours(read["/blocks"][0]) == {free: 46, fixed: 3}
    texts = [
        [text.text for text in entity(message.content, "blocks").texts]
        for message in read["/blocks"]
    ]
    assert texts[0] == []
    assert texts[2] == ["b(4,4) chosen"]
    assert colours(read["/blocks"][2]) == {free: 46, fixed: 2, chosen: 1}
    assert texts[-1] == ["b(4,4) held"]
    assert colours(read["/blocks"][-1]) == {free: 46, fixed: 2, held: 1}
    assert texts == sorted(texts)


def test_the_log_tells_the_plans_reasons_in_order_and_how_it_went(
    read: dict[str, list[Read]], trial_log: Path
) -> None:
    said = [(one.content.name, one.content.message) for one in read["/log"]]
    plans = source(trial_log, "planner/plan")
    expected = [sentence for plan in plans for sentence in plan.explanation]
    sentences = [text for who, text in said if who == "planner" and not text.startswith("plan ")]
    assert sentences == expected
    assert len(expected) == 3
    assert said[0] == (
        "planner",
        "plan 1 (initial, weighted): reach(psm1,b(4,4)) → grasp(psm1,b(4,4)) → pull(psm1,b(4,4))",
    )
    assert ("motion", "pull(psm1,b(4,4)) interrupted: force_soft") in said
    assert said[-2:] == [
        ("log", "late, tick = 12"),
        ("executive", "success: the region of interest is visible"),
    ]
    levels = [one.content.level for one in read["/log"] if "interrupted" in one.content.message]
    assert levels == [Log.WARNING]


def test_the_gauges_decode_by_the_descriptor_in_the_file(
    read: dict[str, list[Read]], trial_log: Path
) -> None:
    robot = source(trial_log, "robot/state")
    for verdict, one in zip(source(trial_log, "sa/verdict"), read["/gauges"], strict=True):
        assert one.schema == "fras.Gauges"
        gauges = one.content
        assert gauges.tick == verdict.tick
        assert gauges.timestamp.ToNanoseconds() == verdict.stamp_ns
        assert gauges.force_n == verdict.max_force_n
        assert (gauges.limit_n, gauges.hard_limit_n) == (0.5, 1.0)
        assert (gauges.visibility, gauges.threshold) == (verdict.visibility, 0.7)
        assert gauges.solve_ms == 2.0
        if verdict.tick:
            passed_ns = robot[verdict.tick].stamp_ns - robot[verdict.tick - 1].stamp_ns
            assert gauges.tick_ms == passed_ns / 1e6
        else:
            assert np.isnan(gauges.tick_ms)


def test_the_same_log_gives_the_same_file(
    foxglove_file: Path, trial_log: Path, tmp_path: Path
) -> None:
    again = tmp_path / "again.mcap"
    export(trial_log, {Format.FOXGLOVE: again})
    assert again.read_bytes() == foxglove_file.read_bytes()
