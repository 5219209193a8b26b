"""Scenarios: what a trial is about, drawn from a seed or read from a file and checked."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from fras_common.scenario.errors import ScenarioError
from fras_common.scenario.loader import check, load, to_toml
from fras_common.scenario.mesh import MeshFacts, fit_to_mesh
from fras_common.scenario.model import (
    AwarenessSection,
    Box,
    Disc,
    GeneratorSection,
    MotionSection,
    PatientSection,
    PlannerSection,
    RunSection,
    Scenario,
    SceneSection,
    TissueSection,
)
from fras_common.scenario.patient import patient_scenario

if TYPE_CHECKING:
    from fras_common.scenario.generator import draw_scene, resolve
    from fras_common.scenario.geometry import attachment_raster, nodes_in_discs

__all__ = [
    "AwarenessSection",
    "Box",
    "Disc",
    "GeneratorSection",
    "MeshFacts",
    "MotionSection",
    "PatientSection",
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
    "patient_scenario",
    "resolve",
    "to_toml",
]

_NEED_NUMPY = {
    "attachment_raster": "geometry",
    "draw_scene": "generator",
    "nodes_in_discs": "geometry",
    "resolve": "generator",
}


def __getattr__(name: str) -> Any:
    """Load what needs numpy when it is first asked for: most processes never do."""
    if name not in _NEED_NUMPY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_NEED_NUMPY[name]}"), name)
