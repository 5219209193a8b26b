"""The views in which Rerun opens a trial: the scene, the plots beside it, what was said below."""

from typing import Any

import rerun.blueprint as rrb

from fras_log.export import shapes


def blueprint() -> Any:
    """Return the layout that a recording carries."""
    scene = rrb.Spatial3DView(
        origin="/world",
        name="scene",
        eye_controls=rrb.EyeControls3D(
            position=shapes.EYE_M, look_target=shapes.LOOK_AT_M, eye_up=(0.0, 0.0, 1.0)
        ),
    )
    plots = rrb.Vertical(
        rrb.TimeSeriesView(origin="/force", name="largest force [N]"),
        rrb.TimeSeriesView(origin="/visibility", name="visible share of the ROI"),
        rrb.TimeSeriesView(origin="/time", name="a tick [ms]"),
        row_shares=[2, 2, 1],
    )
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(scene, plots, column_shares=[3, 2]),
            rrb.TextLogView(origin="/log", name="what was said, and why"),
            row_shares=[3, 1],
        ),
        rrb.TimePanel(timeline="tick", state="collapsed"),
        collapse_panels=True,
    )
