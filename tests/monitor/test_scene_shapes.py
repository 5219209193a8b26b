"""What the scene is made of: closed meshes, bands of colour, points that the tissue carries."""

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose

from fras_common.messages import Vec3
from fras_common.messages.base import Array
from fras_log.export.instruments import instrument
from fras_monitor.outline import outline
from fras_monitor.shapes import Mesh, ball, cones, dashes, instrument_mesh, ring
from fras_monitor.stage import LIFT_M, Followers, OnFaces, blocks_of, ground_of, kinds_of, path_of
from fras_monitor.surface import BANDS, band_colours, bands, share_of
from support import pictures as p


def cone(begin_m: Vec3, end_m: Vec3, begin_radius_m: float, end_radius_m: float) -> Mesh:
    return cones(np.array([[begin_m, end_m]], float), np.array([[begin_radius_m, end_radius_m]]))


def volume(mesh: Mesh) -> float:
    """Signed: above zero where faces are wound outwards."""
    corners = mesh.vertices_m.astype(np.float64)[mesh.faces]
    return float(np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum())


def edges_that_are_not_shared_by_two(mesh: Mesh) -> int:
    faces = mesh.faces.astype(np.int64)
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges = edges[edges[:, 0] != edges[:, 1]]
    _, counts = np.unique(edges, axis=0, return_counts=True)
    return int((counts != 2).sum())


@pytest.mark.parametrize(
    "mesh",
    [
        cone((0, 0, 0), (0, 0, 1), 0.5, 0.2),
        cone((1, 2, 3), (0, -1, 2), 0.1, 0.1),
        ring((1.0, 2.0, 3.0), 0.5, 0.1),
    ],
)
def test_meshes_are_closed_and_wound_outwards(mesh: Mesh):
    assert edges_that_are_not_shared_by_two(mesh) == 0
    assert volume(mesh) > 0.0


def test_a_ball_is_a_ball():
    mesh = ball(2.0)
    assert_allclose(np.linalg.norm(mesh.vertices_m, axis=1), 2.0, rtol=1e-6)
    assert volume(mesh) > 0.0


def test_a_cone_without_length_is_still_finite():
    assert np.isfinite(cone((1, 1, 1), (1, 1, 1), 0.1, 0.1).vertices_m).all()


def test_several_cones_are_those_cones_one_behind_the_other():
    ends_m = np.array([[(0, 0, 0), (0, 0, 1)], [(1, 2, 3), (0, -1, 2)]], float)
    radii_m = np.array([[0.5, 0.2], [0.1, 0.3]])
    both = cones(ends_m, radii_m)
    alone = [cones(ends_m[[row]], radii_m[[row]]) for row in range(2)]
    assert_allclose(both.vertices_m, np.concatenate([one.vertices_m for one in alone]))
    assert edges_that_are_not_shared_by_two(both) == 0
    assert volume(both) == pytest.approx(sum(volume(one) for one in alone))


def test_jaws_open_about_the_tip_and_nothing_else_changes():
    closed, opened = (instrument_mesh(instrument(p.arm(jaw))) for jaw in (-0.2, 1.0))
    tip = np.array(p.arm().tip_in_world.position_m)
    assert np.linalg.norm(closed.vertices_m - tip, axis=1).min() < 1e-3
    moved = np.linalg.norm(closed.vertices_m - opened.vertices_m, axis=1) > 1e-6
    # The two blades of the four parts.
    assert 0.25 < moved.mean() <= 0.5
    assert closed.faces.shape == opened.faces.shape


def test_dashes_run_from_end_to_end_and_none_where_there_is_no_way():
    drawn = dashes((0, 0, 0), (0, 0, 0.02))
    assert_allclose(drawn[0, 0], (0, 0, 0))
    assert drawn[:, :, 2].max() <= 0.02 + 1e-12
    assert len(dashes((1, 1, 1), (1, 1, 1))) == 0


@pytest.mark.parametrize("by", ["force", "lift", "plain"])
def test_each_face_stands_in_one_band(by: str):
    surface = p.SURFACE.astype(np.int32)
    share = np.array([0.0, 0.0, 0.0, 1.0])
    sorted_in = bands(p.REST_M, surface, share, by)  # type: ignore[arg-type]
    assert len(sorted_in) == BANDS
    corners = np.concatenate([one.vertices_m[one.faces] for one in sorted_in])
    assert sorted(map(tuple, corners.reshape(-1, 9).round(6).tolist())) == sorted(
        map(tuple, p.REST_M[surface].reshape(-1, 9).astype(np.float32).round(6).tolist())
    )
    assert [len(one.faces) for one in sorted_in] == [1, *[0] * (BANDS - 2), 1]


def test_what_cannot_be_coloured_is_coloured_as_nothing():
    force_n = np.array([np.nan, 0.0, 0.25, 9.0])
    share = share_of("force", p.REST_M, p.REST_M, force_n, 1.0)
    assert_allclose(share, [0.0, 0.0, 0.5, 1.0])


@pytest.mark.parametrize("by", ["force", "lift"])
def test_a_scales_lightness_goes_one_way_so_that_it_reads_in_grey(by: str):
    weights = np.array([0.2126, 0.7152, 0.0722])
    light = (np.array(band_colours(by)) / 255.0) ** 2.2 @ weights  # type: ignore[arg-type]
    steps = np.diff(light)
    assert (steps > 0).all() or (steps < 0).all()


def test_points_are_carried_by_the_tissue():
    ground = ground_of(p.model())
    blocks = blocks_of(p.context(), ground, p.tissue(tick=1))
    assert blocks.exact
    lifted = p.tissue(tick=2, lift_m=0.01).nodes_m.floats()
    expected = np.array(p.context().blocks_m) + np.array([0.0, 0.0, 0.01])
    assert_allclose(blocks.carried.places_m(lifted), expected, atol=1e-7)


def test_a_context_of_another_tick_ties_its_points_to_the_tissue_at_rest():
    # Else they would be drawn where the tissue was, as a page opened late would.
    ground = ground_of(p.model())
    tissue = p.tissue(tick=9, lift_m=0.02)
    blocks = blocks_of(p.context(tick=1), ground, tissue)
    assert not blocks.exact
    expected = np.array(p.context().blocks_m) + np.array([0.0, 0.0, 0.02])
    assert_allclose(blocks.carried.places_m(tissue.nodes_m.floats()), expected, atol=1e-7)


def test_the_edge_of_the_attachments_is_shown_on_the_upper_face():
    ground = ground_of(p.model())
    ends_m = ground.edges.places_m(ground.rest_m)
    # Around one cell of the raster, 2.5 mm wide.
    assert len(ends_m) == 4 * 2
    assert_allclose(ends_m.min(axis=0), [0.00875, 0.00875, 0.005])
    assert_allclose(ends_m.max(axis=0), [0.01125, 0.01125, 0.005])
    assert len(Followers.of(np.zeros((0, 3)), p.REST_M).places_m(p.REST_M)) == 0


def test_on_a_curved_tissue_the_edge_lies_where_the_upper_face_is():
    curved_m = p.REST_M * [1.0, 1.0, 0.0] + [[0, 0, 0.001], [0, 0, 0.004], [0, 0, 0], [0, 0, 0]]
    below_m = curved_m - [0.0, 0.0, 0.005]
    under = p.SURFACE[:, ::-1]
    model = msgspec.structs.replace(
        p.model(),
        nodes_m=Array.of(np.concatenate([below_m, curved_m]), "<f8"),
        surface=Array.of(np.concatenate([under, p.SURFACE + 4]), "<i4"),
    )
    ground = ground_of(model)
    places_m = ground.edges.places_m(ground.rest_m)
    assert_allclose(places_m.min(axis=0)[:2], [0.00875, 0.00875])
    # On the plane of the face over it, which falls from 4 mm to 0 and 1 mm at its corners.
    expected_m = 0.001 + 0.03 * places_m[:, 0] - 0.01 * places_m[:, 1]
    assert_allclose(places_m[:, 2], expected_m, atol=1e-12)
    # It stays on a face that is turned, where the vertical way to a node would leave it.
    turned_m = ground.rest_m[:, [2, 1, 0]]
    assert_allclose(ground.edges.places_m(turned_m), places_m[:, [2, 1, 0]], atol=1e-12)


def test_an_outline_is_closed_and_has_no_piece_between_two_cells():
    middles_m = np.array([[0.0, 0.0, 0.1], [0.002, 0.0, 0.1], [0.0, 0.003, 0.1]])
    pieces_m = outline(middles_m)
    # Three cells in an L: of twelve sides two pairs lie between cells.
    assert len(pieces_m) == 8
    ends, counts = np.unique(pieces_m.reshape(-1, 3).round(9), axis=0, return_counts=True)
    assert (counts == 2).all()
    assert_allclose(ends.min(axis=0), [-0.001, -0.0015, 0.1])
    assert_allclose(ends.max(axis=0), [0.003, 0.0045, 0.1])
    assert outline(np.zeros((0, 3))).shape == (0, 2, 3)


def test_two_cells_that_touch_at_a_corner_have_each_an_outline_of_their_own():
    middles_m = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
    for piece_m in outline(middles_m):
        near = np.abs(piece_m[:, None, :] - middles_m[None]).sum(axis=-1).min(axis=1)
        assert_allclose(near, 0.5)
        assert_allclose(np.linalg.norm(piece_m[1] - piece_m[0]), np.sqrt(0.5))


def test_where_the_tissue_lies_double_the_edge_is_shown_on_the_upper_face():
    nodes_m = np.concatenate([p.REST_M, p.REST_M + np.array([0.0, 0.0, 0.01])])
    surface = np.concatenate([p.SURFACE, p.SURFACE + 4]).astype(np.int32)
    for order in (surface, surface[::-1]):
        on = OnFaces.over(np.array([[0.02, 0.02, 0.0]]), nodes_m, order)
        assert_allclose(on.places_m(nodes_m), [[0.02, 0.02, 0.015]])


def test_a_surface_that_nowhere_looks_up_has_no_edge_to_show():
    model = msgspec.structs.replace(p.model(), surface=Array.of(p.SURFACE[:, ::-1], "<i4"))
    ground = ground_of(model)
    assert ground.edges.places_m(ground.rest_m).shape == (0, 3)


def test_held_comes_before_chosen_and_chosen_before_attached():
    context = p.context(
        "in_hand(psm1,b(1,1))", "fixed(b(1,1))", "fixed(b(1,2))", "fixed(b(2,1))",
        "reachable(psm1,b(2,2))",
    )  # fmt: skip
    assert kinds_of(context, "b(1,2)") == ("held", "chosen", "fixed", "free")
    assert kinds_of(p.context(), "")[3] == "out_of_reach"


def test_the_path_of_a_lift_goes_up_from_the_grasp():
    robot = p.robot(phase="lift", grasp_height_m=0.005)
    way = path_of(p.picture_of(robot), {})
    assert_allclose(way[0, 0], robot.arms["psm1"].tip_in_world.position_m)
    assert_allclose(way[-1, 1, :2], (0.02, 0.03))
    assert way[-1, 1, 2] == pytest.approx(0.005 + LIFT_M, abs=0.004)


@pytest.mark.parametrize("phase", [None, "done", "interrupted"])
def test_no_path_is_drawn_while_nothing_is_under_way(phase: str | None):
    assert len(path_of(p.picture_of(p.robot(phase=phase, grasp_height_m=0.005)), {})) == 0
