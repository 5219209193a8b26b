"""The pictures of the tissue: projection, hidden surfaces, and what is carried along."""

import math
from typing import Any

import msgspec
import numpy as np
import pytest

from fras_cli.report.figures import scene
from fras_cli.report.figures.camera import Camera, best_camera, facing, normals, seen_share
from fras_common.messages import Array, Pose

ROOF = np.array([[[-1.0, -1, 1], [1, -1, 1], [1, 1, 1]], [[-1.0, -1, 1], [1, 1, 1], [-1, 1, 1]]])


@pytest.mark.parametrize("azimuth", [-2.0, 0.0, 0.7])
def test_the_camera_keeps_lengths_and_angles(azimuth: float) -> None:
    axes = Camera(azimuth).axes
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1.0)


def test_up_is_up_and_the_near_is_nearer() -> None:
    camera = Camera(-math.pi / 2)
    up, near, far = camera.project(np.array([[0.0, 0, 1], [0, -1, 0], [0, 1, 0]]))
    assert up[0] == pytest.approx(0.0)
    assert up[1] > 0.0
    assert near[2] > far[2]


def test_only_the_upper_face_faces_a_camera_above() -> None:
    camera = Camera(0.3)
    assert facing(camera, ROOF).all()
    assert not facing(camera, ROOF[:, ::-1]).any()
    np.testing.assert_allclose(normals(ROOF), [[0, 0, 1], [0, 0, 1]])


def test_a_roof_hides_what_is_under_it_but_not_what_is_above() -> None:
    camera = Camera(0.0, math.radians(80.0))
    assert seen_share(camera, np.array([[0.0, 0.0, 0.0]]), ROOF) == 0.0
    assert seen_share(camera, np.array([[0.0, 0.0, 2.0]]), ROOF) == 1.0
    assert seen_share(camera, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]), ROOF) == 0.5


def test_the_camera_looks_in_where_the_roof_is_open() -> None:
    # Walls on all sides but that towards +x.
    wall = np.array([[[-1.0, -3, -1], [-1, 3, -1], [-1, 0, 9]]])
    left = np.array([[[-3.0, -1, -1], [3, -1, -1], [0, -1, 9]]])
    right = np.array([[[-3.0, 1, -1], [3, 1, -1], [0, 1, 9]]])
    walls = np.concatenate([wall, left, right])
    camera = best_camera(np.zeros((1, 3)), [walls])
    assert math.cos(camera.azimuth_rad) > 0.8


def test_points_are_carried_with_the_upper_face(story: Any) -> None:
    model, state = story.model(), story.tissue(47)
    tip = story.tip_m(47) - story.tip_m(18)
    places, upward = scene.carried(model, state, np.array([[0.05, 0.06, 0.0], [0.5, 0.5, 0.0]]))
    assert len(places) == 1
    np.testing.assert_allclose(np.linalg.norm(upward, axis=1), 1.0)
    at_rest, _ = scene.carried(model, story.tissue(0), np.array([[0.013, 0.027, 0.0]]))
    np.testing.assert_allclose(at_rest, [[0.013, 0.027, 0.005]], atol=1e-8)
    assert 0.005 < places[0, 2] <= 0.005 + tip[2] + 1e-9


def test_attached_points_stay_where_they_are(story: Any) -> None:
    model = story.model()
    points = model.fixed_points_m.floats()
    places, _ = scene.carried(model, story.tissue(47), points)
    assert len(places) == len(points)
    moved = np.linalg.norm(places - points - [0, 0, 0.005], axis=1)
    assert np.median(moved) < 1e-6


def test_the_instrument_points_where_its_frame_says() -> None:
    down = Pose(position_m=(0.0, 0.0, 0.01), quaternion_xyzw=(1.0, 0.0, 0.0, 0.0))
    np.testing.assert_allclose(scene.approach(down), [0.0, 0.0, -1.0], atol=1e-15)
    painted = scene.tool_paint(Camera(0.4), down).triangles_m
    assert painted[..., 2].min() == pytest.approx(0.01)
    assert painted[..., 2].max() == pytest.approx(0.01 + scene.TOOL_LENGTH_M)


def test_balls_and_boxes_are_wound_outwards(story: Any) -> None:
    ball = scene.roi_paint(story.model()).triangles_m - np.asarray(story.model().roi_m)
    outwards = np.einsum("nx,nx->n", normals(ball), ball.mean(axis=1))
    assert (outwards >= 0.0).all()
    model = story.model()
    box = model.nodes_m.floats()[model.surface.ints()]
    centre = box.reshape(-1, 3).mean(axis=0)
    assert (np.einsum("nx,nx->n", normals(box), box.mean(axis=1) - centre) > 0.0).all()


def test_of_two_faces_above_each_other_the_upper_carries(story: Any) -> None:
    shelf = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    nodes = np.concatenate([shelf, shelf + np.array([0, 0, 1])])
    model = msgspec.structs.replace(
        story.model(),
        nodes_m=Array.of(nodes, "<f8"),
        surface=Array.of(np.arange(6).reshape(2, 3), "<i4"),
    )
    nodes_m = Array.of(nodes, "<f4")
    state = msgspec.structs.replace(story.tissue(0), nodes_m=nodes_m, nodal_force_n=nodes_m)
    places, _ = scene.carried(model, state, np.array([[0.25, 0.25, 0.0]]))
    np.testing.assert_allclose(places, [[0.25, 0.25, 1.0]])
