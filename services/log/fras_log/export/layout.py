"""A layout for Foxglove and Lichtblick in which one sees an exported trial at once."""

import json
from math import atan2, degrees, hypot
from typing import Any, Final

from fras_log.export import shapes

_GAUGES: Final = "/gauges"


def layout() -> bytes:
    """Return the layout as a file to import."""
    (x, y, z), target = shapes.EYE_M, shapes.LOOK_AT_M
    across, depth, up = x - target[0], y - target[1], z - target[2]
    content: dict[str, Any] = {
        "configById": {
            "3D!scene": _scene(across, depth, up),
            "Plot!force": _plot(
                "largest force [N]",
                [
                    ("force_n", "#56b4e9"),
                    ("limit_n", "#d55e00"),
                    ("hard_limit_n", "#cc79a7"),
                ],
            ),
            "Plot!visibility": _plot(
                "visible share of the ROI", [("visibility", "#56b4e9"), ("threshold", "#8b949e")]
            ),
            "Plot!time": _plot("a tick [ms]", [("tick_ms", "#8b949e"), ("solve_ms", "#009e73")]),
            "RosOut!log": {"topicToRender": "/log", "minLogLevel": 1, "searchTerms": list[str]()},
        },
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": _split(
            "column",
            _split(
                "row",
                "3D!scene",
                _split(
                    "column",
                    "Plot!force",
                    _split("column", "Plot!visibility", "Plot!time", 60),
                    40,
                ),
                60,
            ),
            "RosOut!log",
            75,
        ),
    }
    return json.dumps(content, indent=2).encode() + b"\n"


def _scene(across: float, depth: float, up: float) -> dict[str, Any]:
    """Look from where the report's camera likes to stand, in the viewer's spherical terms.

    Its angle about z is counted from -y, clockwise seen from above.
    """
    return {
        "cameraState": {
            "perspective": True,
            "distance": hypot(across, depth, up),
            "phi": degrees(atan2(hypot(across, depth), up)),
            "thetaOffset": degrees(atan2(-across, -depth)),
            "target": [0, 0, 0],
            "targetOffset": list(shapes.LOOK_AT_M),
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            "near": 0.001,
            "far": 10,
        },
        "followMode": "follow-none",
        "followTf": "world",
        "scene": {"backgroundColor": "#ffffff", "transforms": {"axisScale": 0.02}},
        "topics": {
            topic: {"visible": True} for topic in ("/scene", "/tissue", "/tools", "/blocks")
        },
        "layers": {},
        "transforms": {},
        "publish": {},
        "imageMode": {},
    }


def _plot(title: str, series: list[tuple[str, str]]) -> dict[str, Any]:
    paths = [
        {
            "value": f"{_GAUGES}.{field}",
            "label": field,
            "color": colour,
            "enabled": True,
            "timestampMethod": "receiveTime",
        }
        for field, colour in series
    ]
    return {
        "foxglovePanelTitle": title,
        "lichtblickPanelTitle": title,
        "paths": paths,
        "xAxisVal": "timestamp",
        "showLegend": True,
        "legendDisplay": "floating",
        "isSynced": True,
        "showXAxisLabels": True,
        "showYAxisLabels": True,
    }


def _split(direction: str, first: Any, second: Any, share: float) -> dict[str, Any]:
    return {
        "direction": direction,
        "first": first,
        "second": second,
        "splitPercentage": share,
    }
