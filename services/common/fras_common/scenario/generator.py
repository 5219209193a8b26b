"""Random scenes: attachment patches as discs, and a region of interest that keeps clear of them."""

from typing import Final

import msgspec
import numpy as np
from numpy.typing import NDArray

from fras_common.errors import FrasError
from fras_common.scenario.geometry import bottom_raster, covered
from fras_common.scenario.model import Disc, Scenario, SceneSection
from fras_common.scenario.patient import patient_scenario

ROI_DRAWS: Final = 2000
MAX_REDRAWS: Final = 1000


class NoRoomForRoi(FrasError):
    """No region of interest keeps its distances, however often the patches are drawn again."""


def resolve(scenario: Scenario) -> Scenario:
    """Give the scenario its scene: the one in the file, or one drawn from its seed.

    Returns
    -------
    Scenario
        The same scenario with `scene` present; what services receive and logs keep.

    Raises
    ------
    NoRoomForRoi
        See `draw_scene`.
    ScenarioError
        No patient can be derived from it.
    """
    if scenario.scene is None:
        scenario = msgspec.structs.replace(scenario, scene=draw_scene(scenario))
    patient_scenario(scenario)
    return scenario


def draw_scene(scenario: Scenario) -> SceneSection:
    """Draw patches and ROI from `scenario.seed`.

    Discs (centre uniform on the bottom face, radius uniform in the generator's range) are added
    until the attached fraction of the raster is covered; the last one shrinks to meet it exactly.
    The ROI is uniform, away from the edges and from every covered raster point. Where no ROI fits,
    everything is drawn again from (seed, n) and n is recorded as `redraws`.

    Raises
    ------
    NoRoomForRoi
        After `MAX_REDRAWS` attempts: the fraction or the distances ask for too much.
    """
    for redraw in range(MAX_REDRAWS):
        rng = np.random.default_rng([scenario.seed, redraw])
        discs = _draw_discs(scenario, rng)
        roi = _draw_roi(scenario, discs, rng)
        if roi is not None:
            return SceneSection(roi_m=roi, discs=discs, redraws=redraw)
    settings = scenario.generator
    raise NoRoomForRoi(
        f"no region of interest keeps {settings.roi_edge_margin_m} m from the edges and "
        f"{settings.clearance_m} m from attachments covering {settings.attached_fraction:.0%}: "
        "lower generator.attached_fraction, generator.clearance_m or generator.roi_edge_margin_m",
        redraws=MAX_REDRAWS,
    )


def _draw_discs(scenario: Scenario, rng: np.random.Generator) -> tuple[Disc, ...]:
    size, settings = scenario.tissue.size_m, scenario.generator
    raster = bottom_raster(size)
    wanted = round(settings.attached_fraction * len(raster))
    inside = np.zeros(len(raster), dtype=np.bool_)
    discs: list[Disc] = []
    while (missing := wanted - int(inside.sum())) > 0:
        center = (float(rng.uniform(0, size[0])), float(rng.uniform(0, size[1])))
        radius = float(rng.uniform(settings.disc_radius_min_m, settings.disc_radius_max_m))
        distance = np.hypot(raster[:, 0] - center[0], raster[:, 1] - center[1])
        fresh = np.sort(distance[~inside & (distance <= radius)])
        if len(fresh) >= missing:
            radius = float(fresh[missing - 1])
        if len(fresh):
            discs.append(Disc(center_m=center, radius_m=radius))
            inside |= distance <= radius
    return tuple(discs)


def _draw_roi(
    scenario: Scenario, discs: tuple[Disc, ...], rng: np.random.Generator
) -> tuple[float, float, float] | None:
    size, settings = scenario.tissue.size_m, scenario.generator
    margin = settings.roi_edge_margin_m
    if min(size[0], size[1]) <= 2 * margin:
        return None
    raster = bottom_raster(size)
    attached: NDArray[np.float64] = raster[covered(raster, discs)]
    if len(attached) == len(raster):
        return None
    candidates = rng.uniform([margin, margin], [size[0] - margin, size[1] - margin], (ROI_DRAWS, 2))
    for x, y in candidates:
        if (np.hypot(attached[:, 0] - x, attached[:, 1] - y) >= settings.clearance_m).all():
            return (float(x), float(y), 0.0 - settings.roi_depth_m)
    return None
