"""Scenes from a seed: attached fraction exact, clearances kept, the same for the same seed."""

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fras_common.scenario import (
    Disc,
    GeneratorSection,
    Scenario,
    SceneSection,
    TissueSection,
    attachment_raster,
    check,
    draw_scene,
    generator,
    nodes_in_discs,
    resolve,
)
from fras_common.scenario.generator import NoRoomForRoi
from fras_common.scenario.geometry import bottom_raster, covered

SIZE = (0.1, 0.12, 0.005)


def scenario(seed: int = 0, size: tuple[float, float, float] = SIZE, **settings: float) -> Scenario:
    return Scenario(
        seed=seed, tissue=TissueSection(size_m=size), generator=GeneratorSection(**settings)
    )


def within(point: tuple[float, ...], disc: Disc) -> bool:
    x, y = point[0] - disc.center_m[0], point[1] - disc.center_m[1]
    return bool(np.hypot(x, y) <= disc.radius_m)


# --- raster -----------------------------------------------------------------------------------


def test_the_raster_has_cells_of_two_and_a_half_millimetres():
    raster = bottom_raster(SIZE)
    assert raster.shape == (40 * 48, 2)
    np.testing.assert_allclose(raster[0], [0.00125, 0.00125])
    np.testing.assert_allclose(raster[1] - raster[0], [0.0, 0.0025], atol=1e-15)
    np.testing.assert_allclose(raster[-1], [0.1 - 0.00125, 0.12 - 0.00125])


def test_a_tissue_smaller_than_a_cell_has_one():
    np.testing.assert_allclose(bottom_raster((0.001, 0.001, 0.001)), [[0.0005, 0.0005]])


def test_a_discs_edge_belongs_to_it():
    points = np.array([[0.0, 0.0], [0.03, 0.04], [0.03, 0.0401], [0.05, 0.0]])
    disc = Disc(center_m=(0.0, 0.0), radius_m=0.05)
    assert covered(points, [disc]).tolist() == [True, True, False, True]
    assert covered(points, []).tolist() == [False] * 4


def test_attachment_points_lie_on_the_bottom():
    disc = Disc(center_m=(0.05, 0.06), radius_m=0.01)
    points = attachment_raster(SIZE, [disc])
    assert points.shape[1] == 3
    assert (points[:, 2] == 0.0).all()
    assert len(points) == pytest.approx(np.pi * 0.01**2 / 0.0025**2, rel=0.1)
    assert all(within(tuple(point), disc) for point in points)
    assert attachment_raster(SIZE, []).shape == (0, 3)


@given(
    st.lists(
        st.builds(
            Disc,
            center_m=st.tuples(st.floats(0, 0.1), st.floats(0, 0.12)),
            radius_m=st.floats(0, 0.06),
        ),
        max_size=4,
    )
)
@settings(deadline=None, max_examples=50)
def test_fixed_nodes_are_the_bottom_nodes_in_a_disc(discs: list[Disc]):
    axes = [np.linspace(0.0, extent, count) for extent, count in zip(SIZE, (6, 7, 2), strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    bottom = np.flatnonzero(nodes[:, 2] == 0.0).astype(np.int32)
    fixed = nodes_in_discs(nodes, bottom, discs)
    wanted = [index for index in bottom if any(within(tuple(nodes[index]), disc) for disc in discs)]
    assert fixed.tolist() == wanted
    assert fixed.dtype == np.int32


# --- scenes -----------------------------------------------------------------------------------


@pytest.mark.parametrize("fraction", [0.0, 0.1, 0.3, 0.4, 0.5, 0.7])
def test_the_attached_fraction_is_met_exactly_on_the_raster(fraction: float):
    for seed in range(20):
        scene = draw_scene(scenario(seed, attached_fraction=fraction))
        assert len(attachment_raster(SIZE, scene.discs)) == round(fraction * 1920)


def test_the_fraction_is_exact_on_odd_sizes_too():
    size = (0.0731, 0.0997, 0.004)
    for seed in range(10):
        scene = draw_scene(scenario(seed, size, attached_fraction=0.33))
        raster = bottom_raster(size)
        assert covered(raster, scene.discs).sum() == round(0.33 * len(raster))


def test_discs_keep_their_range_but_for_the_last_which_may_shrink():
    for seed in range(30):
        scene = draw_scene(scenario(seed))
        assert all(0.02 <= disc.radius_m <= 0.04 for disc in scene.discs[:-1])
        assert scene.discs[-1].radius_m <= 0.04
        for disc in scene.discs:
            assert 0.0 <= disc.center_m[0] <= 0.1
            assert 0.0 <= disc.center_m[1] <= 0.12


@pytest.mark.parametrize(("margin", "clearance"), [(0.015, 0.01), (0.03, 0.02), (0.0, 0.0)])
def test_the_roi_keeps_its_distances(margin: float, clearance: float):
    for seed in range(20):
        scene = draw_scene(scenario(seed, roi_edge_margin_m=margin, clearance_m=clearance))
        x, y, z = scene.roi_m
        assert margin <= x <= 0.1 - margin
        assert margin <= y <= 0.12 - margin
        points = attachment_raster(SIZE, scene.discs)
        assert np.hypot(points[:, 0] - x, points[:, 1] - y).min() >= clearance
        assert z == 0.0


def test_the_roi_lies_as_deep_as_told():
    scene = draw_scene(scenario(roi_depth_m=0.004))
    assert scene.roi_m[2] == -0.004


def test_a_shallow_roi_is_no_negative_zero():
    # -0.0 and 0.0 differ in the bytes of a message, and so in digests.
    assert str(draw_scene(scenario()).roi_m[2]) == "0.0"


def test_one_seed_gives_one_scene_and_another_seed_another():
    assert draw_scene(scenario(7)) == draw_scene(scenario(7))
    scenes = {msgspec.msgpack.encode(draw_scene(scenario(seed))) for seed in range(50)}
    assert len(scenes) == 50


def test_the_scene_does_not_depend_on_the_mesh():
    fine = TissueSection(node_counts=(41, 49, 3))
    assert draw_scene(Scenario(seed=3, tissue=fine)) == draw_scene(Scenario(seed=3))


def test_centres_and_rois_fill_the_face():
    scenes = [draw_scene(scenario(seed)) for seed in range(200)]
    centres = np.array([disc.center_m for scene in scenes for disc in scene.discs])
    np.testing.assert_allclose(centres.mean(axis=0), [0.05, 0.06], atol=0.005)
    np.testing.assert_allclose(centres.std(axis=0), np.array([0.1, 0.12]) / 12**0.5, rtol=0.15)
    rois = np.array([scene.roi_m[:2] for scene in scenes])
    np.testing.assert_allclose(rois.mean(axis=0), [0.05, 0.06], atol=0.006)


def test_drawing_again_is_recorded():
    redraws = [draw_scene(scenario(seed, attached_fraction=0.85)).redraws for seed in range(20)]
    assert max(redraws) > 0
    assert min(redraws) == 0
    again = draw_scene(scenario(int(np.argmax(redraws)), attached_fraction=0.85))
    assert again.redraws == max(redraws)


def test_no_room_for_the_roi_says_what_to_change(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(generator, "MAX_REDRAWS", 5)
    with pytest.raises(NoRoomForRoi, match=r"generator\.attached_fraction") as caught:
        draw_scene(scenario(attached_fraction=1.0))
    assert caught.value.values == {"redraws": 5}
    with pytest.raises(NoRoomForRoi):
        draw_scene(scenario(roi_edge_margin_m=0.05))


def test_the_smallest_discs_still_come_to_an_end():
    scene = draw_scene(scenario(disc_radius_min_m=0.003, disc_radius_max_m=0.003))
    assert len(attachment_raster(SIZE, scene.discs)) == 768


def test_a_scene_of_the_file_is_left_alone():
    scene = SceneSection(roi_m=(0.05, 0.06, 0.0))
    assert resolve(Scenario(seed=1, scene=scene)).scene is scene


def test_a_drawn_scene_is_a_legal_one():
    for seed in range(20):
        resolved = resolve(scenario(seed, roi_depth_m=0.009))
        assert resolved.scene is not None
        assert check(resolved) == resolved
