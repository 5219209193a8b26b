"""Pulls of the real simulator for `benchmarks.awareness`: the force in each tick, and shapes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fras_common.scenario import (
    Scenario,
    SceneSection,
    attachment_raster,
    nodes_in_discs,
    resolve,
)
from fras_sa.awareness import TissueModel
from fras_sim.fem import Mesh, TissueParameters, TissueSimulator, ToolInput, box_mesh

OPEN_RAD, CLOSED_RAD = 1.0, -0.3
LIFT_PER_TICK_M = 0.0004
TICKS = 125
SHAPE_EVERY = 12
BLOCKS = 7

Floats = NDArray[np.float64]
Counts = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class Pull:
    """One lift by 50 mm at 20 mm/s, on the seed's scene, without limit.

    Parameters
    ----------
    model : TissueModel
        The scene at rest.
    force_n : list of float
        Largest nodal force in each tick.
    shapes : list of ndarray, shape (n_nodes, 3) [m]
        The tissue in each twelfth tick.
    """

    model: TissueModel
    force_n: list[float]
    shapes: list[Floats]


def model_of(seed: int, mesh: Mesh) -> TissueModel:
    """Return a seed's scene on a mesh, as situation awareness sees it."""
    scenario = resolve(Scenario(seed=seed))
    scene = _drawn(scenario)
    return TissueModel(
        nodes_m=mesh.nodes_m,
        triangles=mesh.surface,
        fixed_points_m=attachment_raster(scenario.tissue.size_m, scene.discs),
        roi_m=np.array(scene.roi_m),
        dt_s=scenario.tissue.dt_s,
    )


def pull(seed: int, counts: Counts) -> Pull:
    """Grasp as the planner's criterion would, and lift."""
    scenario = resolve(Scenario(seed=seed))
    scene = _drawn(scenario)
    mesh = box_mesh(node_counts=counts)
    attached = nodes_in_discs(mesh.nodes_m, mesh.bottom_nodes, scene.discs)
    tip_m = _grasped(mesh.nodes_m[attached, :2], np.array(scene.roi_m[:2]))
    tissue = TissueSimulator(mesh, TissueParameters(dt_s=scenario.tissue.dt_s), attached)
    tissue.measure({"psm1": ToolInput(tip_m, OPEN_RAD)})
    force_n: list[float] = []
    shapes: list[Floats] = []
    for tick in range(TICKS + 1):
        at_m = tip_m + np.array([0.0, 0.0, LIFT_PER_TICK_M * tick])
        step = tissue.step({"psm1": ToolInput(at_m, CLOSED_RAD)})
        force_n.append(step.max_force_n)
        if tick % SHAPE_EVERY == 0:
            shapes.append(np.array(step.nodes_m, dtype=np.float64))
    return Pull(model_of(seed, mesh), force_n, shapes)


def on_mesh(shape_m: Floats, coarse: Counts, fine: Counts) -> Floats:
    """Return the nodes of a finer box in the shape of a coarse one.

    The two faces are interpolated on the coarse surface's own triangles, so that the shape is the
    same to rounding; between the faces linearly.
    """
    rest = box_mesh(node_counts=fine).nodes_m
    mesh = box_mesh(node_counts=coarse)
    top_m = mesh.nodes_m[:, 2].max()
    faces = [_on_face(rest[:, :2], mesh, shape_m, height_m) for height_m in (0.0, top_m)]
    up = rest[:, 2:] / top_m
    return (1.0 - up) * faces[0] + up * faces[1]


def _on_face(points: Floats, mesh: Mesh, shape_m: Floats, height_m: float) -> Floats:
    corners = mesh.nodes_m[mesh.surface]
    triangles = mesh.surface[(np.abs(corners[:, :, 2] - height_m) < 1e-9).all(axis=1)]
    a, b, c = (mesh.nodes_m[triangles[:, k], :2] for k in range(3))
    first, second = b - a, c - a
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    offset = points[:, None] - a
    s = (offset[..., 0] * second[:, 1] - offset[..., 1] * second[:, 0]) / area
    t = (first[:, 0] * offset[..., 1] - first[:, 1] * offset[..., 0]) / area
    places = np.stack([1.0 - s - t, s, t], axis=-1)
    inside = places.min(axis=-1).argmax(axis=1)
    weights = places[np.arange(len(points)), inside]
    corners_now: Floats = shape_m[triangles[inside]]
    return (weights[:, :, None] * corners_now).sum(axis=1)


def _grasped(attached_m: Floats, roi_m: Floats) -> Floats:
    """Return the block that `weighted` prefers: far from attachments, near the ROI."""
    sides = [(np.arange(BLOCKS) + 0.5) * length_m / BLOCKS for length_m in (0.1, 0.12)]
    x, y = np.meshgrid(*sides)
    blocks = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 0.005)])
    gaps_m = np.linalg.norm(blocks[:, None, :2] - attached_m, axis=2).min(axis=1)
    ways_m = np.linalg.norm(blocks[:, :2] - roi_m, axis=1)
    best: Floats = blocks[int(np.argmax(2 * gaps_m - ways_m))]
    return best


def _drawn(scenario: Scenario) -> SceneSection:
    if scenario.scene is None:
        raise RuntimeError("a resolved scenario has a scene")
    return scenario.scene
