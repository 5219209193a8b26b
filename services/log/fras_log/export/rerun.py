"""Writes what a trial shows as a Rerun recording (`.rrd`), with the views to see it in."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np
import rerun as rr

from fras_log import colours as palette
from fras_log.anchors import vertex_normals
from fras_log.export import shapes
from fras_log.export.blueprint import blueprint
from fras_log.export.facts import (
    Arms,
    BlockKind,
    Blocks,
    Fact,
    Gauges,
    Instrument,
    Level,
    Moment,
    Sentence,
    Stage,
    Tissue,
)
from fras_log.export.outputs import OutputUnwritable

BATCH: Final = 64
GAUGES: Final[dict[str, str]] = {
    "force_n": "/force/measured",
    "limit_n": "/force/limit",
    "hard_limit_n": "/force/hard_limit",
    "visibility": "/visibility/measured",
    "threshold": "/visibility/threshold",
    "tick_ms": "/time/tick_ms",
    "solve_ms": "/time/solve_ms",
}
_LEVELS: Final[dict[Level, str]] = {"info": "INFO", "warning": "WARN", "error": "ERROR"}
_Columns = Callable[[Sequence[Any]], Any]


@contextmanager
def _named() -> Generator[None]:
    """Give a name to what the library says of a full disk: a thread of its own writes."""
    try:
        yield
    except RuntimeError as error:
        raise OutputUnwritable(str(error)) from error


class RerunFile:
    """One file under way.

    Rows are sent in batches, as columns: a message each would carry the time of the export too,
    and take ten times as long.

    Parameters
    ----------
    path : Path
    about : dict of str to str
        Kept as a property of the recording.
    dt_s : float
        Simulated seconds a tick.
    """

    def __init__(self, path: Path, about: dict[str, str], dt_s: float) -> None:
        self._dt_s = dt_s
        self._surface = np.empty((0, 3), dtype=np.int32)
        self._limit_n, self._top_n = 0.0, 1.0
        self._rows: dict[str, list[tuple[Moment, Any]]] = {}
        self._columns: dict[str, _Columns] = {}
        # Its own properties would say when it was exported, not when it happened.
        self._recording = rr.RecordingStream("fras", send_properties=False)
        with _named():
            self._recording.save(path, default_blueprint=blueprint())
        self._recording.send_recording_name(about["trial"])
        self._recording.send_property("fras", rr.AnyValues(drop_untyped_nones=True, **about))
        self._log_static("/world", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        for path_of, colour, name in shapes.SERIES:
            style = rr.SeriesLines(colors=[palette.rgb(colour)], names=[name], widths=[1.6])
            self._log_static(path_of, style)

    def write(self, fact: Fact) -> None:
        """Take in what a fact shows."""
        match fact:
            case Stage():
                self._write_stage(fact)
            case Tissue():
                self._add("/world/tissue", self._surface_columns, fact.moment, fact)
                self._add("/world/above_limit", self._above_columns, fact.moment, fact)
            case Arms():
                for name, tool in fact.instruments.items():
                    self._add_tool(name, fact.moment, tool)
            case Blocks():
                self._add("/world/blocks", _block_columns, fact.moment, fact)
                # Apart, because the viewer hides the words of so many points.
                self._add("/world/grasp", _grasp_columns, fact.moment, fact)
            case Gauges():
                for name, path in GAUGES.items():
                    self._add(path, _scalar_columns, fact.moment, getattr(fact, name))
            case Sentence():
                self._add("/log", _text_columns, fact.moment, fact)

    def close(self, damage: str) -> None:
        """Send what is left; `damage` is what ended the log early, empty where nothing did."""
        self._send_all()
        if damage:
            self._recording.send_property("fras_cut", rr.AnyValues(damage=damage))
        with _named():
            self._recording.flush()
        self._recording.disconnect()

    def _add(self, path: str, columns: _Columns, moment: Moment, row: Any) -> None:
        self._columns[path] = columns
        rows = self._rows.setdefault(path, [])
        rows.append((moment, row))
        if len(rows) >= BATCH:
            self._send(path)

    def _add_tool(self, name: str, moment: Moment, tool: Instrument) -> None:
        tip = f"/world/{name}_tip"
        if tip not in self._rows:
            self._log_static(tip, rr.TransformAxes3D(axis_length=shapes.TIP_AXES_M))
        self._add(tip, _tip_columns, moment, tool)
        self._add(f"/world/{name}", _tool_columns, moment, tool)

    def _send_all(self) -> None:
        for path in self._rows:
            self._send(path)

    def _send(self, path: str) -> None:
        rows = self._rows[path]
        if not rows:
            return
        moments = [moment for moment, _ in rows]
        columns = self._columns[path]([row for _, row in rows])
        rr.send_columns(path, self._times(moments), columns, recording=self._recording)
        rows.clear()

    def _times(self, moments: Sequence[Moment]) -> list[rr.TimeColumn]:
        ticks = np.array([moment.tick for moment in moments], dtype=np.int64)
        published = np.array([moment.stamp_ns for moment in moments], dtype="datetime64[ns]")
        arrived = np.array([moment.arrival_ns for moment in moments], dtype="datetime64[ns]")
        return [
            rr.TimeColumn("tick", sequence=ticks),
            rr.TimeColumn("simulated", duration=ticks * self._dt_s),
            rr.TimeColumn("published", timestamp=published),
            rr.TimeColumn("arrived", timestamp=arrived),
        ]

    def _log_static(self, path: str, content: Any) -> None:
        self._recording.log(path, content, static=True)

    def _write_stage(self, stage: Stage) -> None:
        """Draw what stays: faces, attachment points, ROI with the circle to clear, scale."""
        self._send_all()
        self._surface = stage.surface
        self._limit_n, self._top_n = stage.limit_n, stage.hard_limit_n
        self._log_static("/world/tissue", rr.Mesh3D.from_fields(triangle_indices=stage.surface))
        self._log_static(
            "/world/attachments",
            rr.Points3D(
                stage.attachments_m,
                radii=shapes.ATTACHMENT_RADIUS_M,
                colors=palette.rgb(palette.ATTACHMENT),
            ),
        )
        blue = palette.rgb(palette.ROI)
        ball = rr.Points3D([stage.roi_m], radii=shapes.ROI_RADIUS_M, colors=blue, labels=["ROI"])
        self._log_static("/world/roi", ball)
        circle = rr.LineStrips3D([shapes.ring(stage)], radii=shapes.RING_RADIUS_M, colors=blue)
        self._log_static("/world/roi/to_clear", circle)
        strip = shapes.legend(stage)
        mesh = rr.Mesh3D(
            vertex_positions=strip.vertices_m,
            vertex_colors=strip.colours,
            triangle_indices=strip.triangles,
        )
        self._log_static("/world/scale", mesh)
        words = rr.Points3D(
            np.array([place_m for _, place_m in strip.labels]),
            radii=shapes.RING_RADIUS_M,
            colors=palette.rgb(palette.WORDS),
            labels=[text for text, _ in strip.labels],
            show_labels=True,
        )
        self._log_static("/world/scale/words", words)

    def _surface_columns(self, rows: Sequence[Tissue]) -> Any:
        top_n, surface = self._top_n, self._surface
        lengths = [len(row.nodes_m) for row in rows]
        colours = [palette.force_rgb(row.force_n, top_n) for row in rows]
        normals = [vertex_normals(row.nodes_m, surface) for row in rows]
        return rr.Mesh3D.columns(
            vertex_positions=np.concatenate([row.nodes_m for row in rows]),
            vertex_colors=np.concatenate(colours),
            vertex_normals=np.concatenate(normals),
        ).partition(lengths)

    def _above_columns(self, rows: Sequence[Tissue]) -> Any:
        places_m = [row.nodes_m[row.force_n > self._limit_n] for row in rows]
        count = len(rows)
        colours = np.tile(np.array(palette.rgb(palette.LIMIT), np.uint8), (count, 1))
        radii = np.full(count, shapes.ABOVE_RADIUS_M)
        return [
            *rr.Points3D.columns(positions=np.concatenate(places_m)).partition(
                [len(places) for places in places_m]
            ),
            *rr.Points3D.columns(colors=colours, radii=radii),
        ]


def _tool_columns(rows: Sequence[Instrument]) -> Any:
    """Shaft and jaws, two strips a row."""
    strips = [strip for row in rows for strip in (row.shaft_m, row.jaws_m)]
    radii = np.tile([shapes.SHAFT_RADIUS_M, shapes.BLADE_RADIUS_M], len(rows))
    colours = np.tile(np.array(palette.rgb(palette.TOOL), np.uint8), (len(strips), 1))
    return rr.LineStrips3D.columns(strips=strips, radii=radii, colors=colours).partition(
        [2] * len(rows)
    )


def _tip_columns(rows: Sequence[Instrument]) -> Any:
    return rr.Transform3D.columns(
        translation=[row.tip_m for row in rows],
        quaternion=[rr.Quaternion(xyzw=row.tip_xyzw) for row in rows],
    )


def _block_columns(rows: Sequence[Blocks]) -> Any:
    kinds: list[BlockKind] = [kind for row in rows for kind in row.kinds]
    return rr.Points3D.columns(
        positions=np.concatenate([row.places_m for row in rows]),
        radii=[shapes.BLOCK_RADII_M[kind] for kind in kinds],
        colors=np.array([palette.rgb(shapes.BLOCK_COLOURS[kind]) for kind in kinds], np.uint8),
    ).partition([len(row.names) for row in rows])


def _grasp_columns(rows: Sequence[Blocks]) -> Any:
    """Name the block that is chosen or held, a little above it."""
    marked = [list(row.marked()) for row in rows]
    places_m = [place_m + shapes.ABOVE_M for row in marked for _, place_m, _ in row]
    kinds: list[BlockKind] = [kind for row in marked for _, _, kind in row]
    return rr.Points3D.columns(
        positions=np.array(places_m).reshape(-1, 3),
        radii=[shapes.RING_RADIUS_M] * len(kinds),
        colors=[palette.rgb(shapes.BLOCK_COLOURS[kind]) for kind in kinds],
        labels=[f"{name} {kind}" for row in marked for name, _, kind in row],
    ).partition([len(row) for row in marked])


def _scalar_columns(rows: Sequence[float]) -> Any:
    return rr.Scalars.columns(scalars=rows)


def _text_columns(rows: Sequence[Sentence]) -> Any:
    return rr.TextLog.columns(
        text=[f"{row.who}: {row.text}" for row in rows],
        level=[_LEVELS[row.level] for row in rows],
    )
