"""The layout for Foxglove and Lichtblick shows what the file holds, from where it should."""

import json
from math import cos, radians, sin
from pathlib import Path
from typing import Any

import pytest

from fras_log.export import shapes
from fras_log.export.layout import layout
from support.exported import read_foxglove


@pytest.fixture(scope="module")
def panels() -> dict[str, Any]:
    return json.loads(layout())["configById"]


def test_every_panel_is_placed_once(panels: dict[str, Any]) -> None:
    def leaves(tree: Any) -> list[str]:
        return [tree] if isinstance(tree, str) else leaves(tree["first"]) + leaves(tree["second"])

    assert sorted(leaves(json.loads(layout())["layout"])) == sorted(panels)
    assert {name.partition("!")[0] for name in panels} == {"3D", "Plot", "RosOut"}


def test_it_shows_all_topics_and_gauges_of_the_file(
    panels: dict[str, Any], foxglove_file: Path
) -> None:
    read = read_foxglove(foxglove_file)
    scenes = {topic for topic in read if read[topic][0].schema == "foxglove.SceneUpdate"}
    assert set(panels["3D!scene"]["topics"]) == scenes
    assert panels["RosOut!log"]["topicToRender"] == "/log"
    assert read["/log"][0].schema == "foxglove.Log"
    fields = {field.name for field in read["/gauges"][0].content.DESCRIPTOR.fields}
    plots = [panel for name, panel in panels.items() if name.startswith("Plot!")]
    drawn = {path["value"] for plot in plots for path in plot["paths"]}
    assert drawn == {f"/gauges.{field}" for field in fields - {"timestamp", "tick"}}


def test_the_camera_stands_where_the_other_viewer_has_it(panels: dict[str, Any]) -> None:
    """By the formula in Lichtblick's CameraStateSettings: a spherical place, y up, turned to z."""
    camera = panels["3D!scene"]["cameraState"]
    phi, theta = radians(camera["phi"]), -radians(camera["thetaOffset"])
    x, y, z = sin(phi) * sin(theta), cos(phi), sin(phi) * cos(theta)
    turned = (x, -z, y)
    place = [
        target + camera["distance"] * part
        for target, part in zip(camera["targetOffset"], turned, strict=True)
    ]
    assert place == pytest.approx(shapes.EYE_M)
    assert camera["targetOffset"] == pytest.approx(shapes.LOOK_AT_M)
