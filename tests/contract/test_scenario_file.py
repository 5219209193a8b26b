"""A scenario is file format and message at once: nothing may be lost on either way."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fras_common.codec import decode, encode
from fras_common.scenario import (
    Scenario,
    ScenarioError,
    SceneSection,
    check,
    load,
    patient_scenario,
    resolve,
    to_toml,
)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("scenario") / "scenario.toml"


def made_possible(scenario: Scenario) -> Scenario:
    """The same scenario with its fields brought into agreement."""
    replace = msgspec.structs.replace
    generator, awareness, scene = scenario.generator, scenario.awareness, scenario.scene
    x, y, z = (min(0.11, max(0.001, extent)) for extent in scenario.tissue.size_m)
    tissue = replace(scenario.tissue, size_m=(x, y, z))
    if tissue.mesh_file is None:
        box = "hex8" if tissue.element == "hex8" else "hex8-sri"
        tissue = replace(tissue, element=box, mesh_scale=1.0)
    if scene is not None:
        (u, v, w), discs = scene.roi_m, scene.discs
        scene = SceneSection(
            roi_m=(abs(u) * x, abs(v) * y, -abs(w) * 0.009),
            discs=tuple(
                replace(d, center_m=(abs(d.center_m[0]) * x, abs(d.center_m[1]) * y)) for d in discs
            ),
            redraws=scene.redraws,
        )
    radii = sorted([generator.disc_radius_min_m, generator.disc_radius_max_m])
    generator = replace(
        generator,
        disc_radius_min_m=max(0.003, radii[0]),
        disc_radius_max_m=max(0.003, radii[1]),
        roi_edge_margin_m=min(generator.roi_edge_margin_m, 0.4 * min(x, y)),
    )
    if awareness.hard_limit_n is not None:
        limits = sorted([awareness.force_limit_n, awareness.hard_limit_n])
        awareness = replace(awareness, force_limit_n=limits[0], hard_limit_n=limits[1])
    motion, deceleration = scenario.motion, max(0.1, scenario.motion.stop_deceleration_m_s2)
    fastest = 2 * deceleration * scenario.tissue.dt_s
    depth_m = -scene.roi_m[2] if scene is not None else generator.roi_depth_m
    awareness = replace(
        awareness, visible_distance_m=max(awareness.visible_distance_m, 1.01 * depth_m)
    )
    tissue = replace(
        tissue, bed=True, node_counts=tuple(min(count, 40) for count in tissue.node_counts)
    )
    boxes = tuple(
        replace(
            box,
            lower_m=tuple(
                max(-1.0, min(pair) - 0.01) for pair in zip(box.lower_m, box.upper_m, strict=True)
            ),
            upper_m=tuple(
                min(1.0, max(pair) + 0.01) for pair in zip(box.lower_m, box.upper_m, strict=True)
            ),
        )
        for box in motion.forbidden_boxes
    )
    motion = replace(
        motion,
        forbidden_boxes=boxes,
        jaw_speed_rad_s=min(motion.jaw_speed_rad_s, 100 * tissue.dt_s),
        stop_deceleration_m_s2=deceleration,
        free_speed_m_s=min(motion.free_speed_m_s, fastest),
        holding_speed_m_s=min(motion.holding_speed_m_s, fastest),
    )
    made = replace(
        scenario,
        tissue=tissue,
        scene=scene,
        generator=generator,
        awareness=awareness,
        motion=motion,
    )
    if scene is not None:
        try:
            patient_scenario(made)
        except ScenarioError:
            made = replace(made, patient=msgspec.UNSET)
    return check(made)


def test_any_valid_scenario_survives_its_file(
    file: Path, instances: Callable[[type[Any]], st.SearchStrategy[Any]]
):
    @given(scenario=instances(Scenario).map(made_possible))
    @settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
    def run(scenario: Scenario):
        file.write_text(to_toml(scenario), encoding="utf-8")
        assert load(file) == scenario
        assert decode(Scenario, encode(scenario), "") == scenario

    run()


def test_a_drawn_scene_survives_its_file_bit_for_bit(file: Path):
    for seed in range(10):
        scenario = resolve(Scenario(name=f"drawn {seed}", seed=seed))
        file.write_text(to_toml(scenario), encoding="utf-8")
        assert load(file) == scenario
