"""Scenarios: what a trial is about, drawn from a seed or read from a file and checked."""

from fras_common.scenario.generator import draw_scene, resolve
from fras_common.scenario.geometry import attachment_raster, nodes_in_discs
from fras_common.scenario.loader import ScenarioError, check, load, to_toml
from fras_common.scenario.mesh import MeshFacts, fit_to_mesh
from fras_common.scenario.model import (
    AwarenessSection,
    Box,
    Disc,
    GeneratorSection,
    MotionSection,
    PlannerSection,
    RunSection,
    Scenario,
    SceneSection,
    TissueSection,
)

__all__ = [
    "AwarenessSection",
    "Box",
    "Disc",
    "GeneratorSection",
    "MeshFacts",
    "MotionSection",
    "PlannerSection",
    "RunSection",
    "Scenario",
    "ScenarioError",
    "SceneSection",
    "TissueSection",
    "attachment_raster",
    "check",
    "draw_scene",
    "fit_to_mesh",
    "load",
    "nodes_in_discs",
    "resolve",
    "to_toml",
]
