"""Writes what a trial shows as MCAP in Foxglove's public schemas, for Foxglove and Lichtblick."""

from collections.abc import Iterable
from typing import IO, Any, Final

import numpy as np
from foxglove_schemas_protobuf import (
    Color_pb2,
    FrameTransform_pb2,
    FrameTransforms_pb2,
    LinePrimitive_pb2,
    Log_pb2,
    Pose_pb2,
    Quaternion_pb2,
    SceneUpdate_pb2,
    Vector3_pb2,
)
from google.protobuf.timestamp_pb2 import Timestamp
from mcap_protobuf.writer import Writer

from fras_log import colours as palette
from fras_log.export import shapes
from fras_log.export.facts import (
    Arms,
    Blocks,
    Fact,
    FloatArray,
    Gauges,
    Level,
    Moment,
    Sentence,
    Stage,
    Tissue,
)
from fras_log.export.gauges import NUMBERS, gauges_class
from fras_log.export.packing import extend

WORLD: Final = "world"
_LEVELS: Final[dict[Level, Any]] = {
    "info": Log_pb2.Log.INFO,
    "warning": Log_pb2.Log.WARNING,
    "error": Log_pb2.Log.ERROR,
}
_NO_TURN: Final = Quaternion_pb2.Quaternion(w=1.0)


class FoxgloveFile:
    """One file under way.

    Parameters
    ----------
    stream : binary file, open for writing
    about : dict of str to str
        Written first, as the metadata record `fras`.
    """

    def __init__(self, stream: IO[bytes], about: dict[str, str]) -> None:
        self._writer = Writer(stream)
        self._writer.add_metadata("fras", about)
        self._gauges: Any = gauges_class()
        self._indices: list[int] = []
        self._limits_n = (0.0, 1.0)

    def write(self, fact: Fact) -> None:
        """Append what a fact shows."""
        match fact:
            case Stage():
                self._write_stage(fact)
            case Tissue():
                self._put("/tissue", fact.moment, self._tissue(fact))
            case Arms():
                self._put("/tf", fact.moment, _frames(fact))
                self._put("/tools", fact.moment, _tools(fact))
            case Blocks():
                self._put("/blocks", fact.moment, _blocks(fact))
            case Gauges():
                numbers = {name: getattr(fact, name) for name in NUMBERS}
                stamp, tick = _stamp(fact.moment), fact.moment.tick
                message = self._gauges(timestamp=stamp, tick=tick, **numbers)
                self._put("/gauges", fact.moment, message)
            case Sentence():
                self._put("/log", fact.moment, _log(fact))

    def close(self, damage: str) -> None:
        """Write the index; `damage` is what ended the log early, empty where nothing did."""
        if damage:
            self._writer.add_metadata("fras.cut", {"damage": damage})
        self._writer.finish()

    def _put(self, topic: str, moment: Moment, message: Any) -> None:
        self._writer.write_message(
            topic,
            message,
            log_time=moment.arrival_ns,
            publish_time=moment.stamp_ns,
            sequence=moment.seq,
        )

    def _write_stage(self, stage: Stage) -> None:
        self._indices = stage.surface.ravel().tolist()
        self._limits_n = (stage.limit_n, stage.hard_limit_n)
        self._put("/scene", stage.moment, _scene(stage))

    def _tissue(self, tissue: Tissue) -> Any:
        limit_n, top_n = self._limits_n
        update = SceneUpdate_pb2.SceneUpdate()
        surface = _add_entity(update, "tissue", tissue.moment)
        colours = palette.force_rgb(tissue.force_n, top_n)
        _add_triangles(surface, tissue.nodes_m, colours, self._indices)
        above = _add_entity(update, "above_limit", tissue.moment)
        places_m = tissue.nodes_m[tissue.force_n > limit_n]
        _add_spheres(above, places_m, shapes.ABOVE_RADIUS_M, palette.LIMIT)
        return update


def _scene(stage: Stage) -> Any:
    """Draw what stays: attachment points, ROI with the circle to clear, scale of the colours."""
    update = SceneUpdate_pb2.SceneUpdate()
    attachments = _add_entity(update, "attachments", stage.moment)
    radius_m = shapes.ATTACHMENT_RADIUS_M
    _add_spheres(attachments, stage.attachments_m, radius_m, palette.ATTACHMENT)
    roi = _add_entity(update, "roi", stage.moment)
    roi_m = np.array(stage.roi_m)
    _add_spheres(roi, roi_m[None], shapes.ROI_RADIUS_M, palette.ROI)
    _add_line(roi, shapes.ring(stage), shapes.RING_RADIUS_M, palette.ROI)
    _add_text(roi, "ROI", roi_m - shapes.ABOVE_M, palette.ROI)
    strip = shapes.legend(stage)
    scale = _add_entity(update, "scale", stage.moment)
    _add_triangles(scale, strip.vertices_m, strip.colours, strip.triangles.ravel().tolist())
    for text, place_m in strip.labels:
        _add_text(scale, text, place_m, palette.WORDS)
    return update


def _frames(arms: Arms) -> Any:
    """Each tip as a frame, `psm1_tip` in the world."""
    return FrameTransforms_pb2.FrameTransforms(
        transforms=[
            FrameTransform_pb2.FrameTransform(
                timestamp=_stamp(arms.moment),
                parent_frame_id=WORLD,
                child_frame_id=f"{name}_tip",
                translation=_vector(*tool.tip_m),
                rotation=_quaternion(*tool.tip_xyzw),
            )
            for name, tool in arms.instruments.items()
        ]
    )


def _tools(arms: Arms) -> Any:
    update = SceneUpdate_pb2.SceneUpdate()
    for name, tool in arms.instruments.items():
        entity = _add_entity(update, name, arms.moment)
        _add_line(entity, np.array(tool.shaft_m), shapes.SHAFT_RADIUS_M, palette.TOOL)
        _add_line(entity, np.array(tool.jaws_m), shapes.BLADE_RADIUS_M, palette.TOOL)
        _add_text(entity, name.upper(), tool.remote_centre_m, palette.TOOL)
    return update


def _blocks(blocks: Blocks) -> Any:
    update = SceneUpdate_pb2.SceneUpdate()
    entity = _add_entity(update, "blocks", blocks.moment)
    for place_m, kind in zip(blocks.places_m, blocks.kinds, strict=True):
        radius_m, colour = shapes.BLOCK_RADII_M[kind], shapes.BLOCK_COLOURS[kind]
        _add_spheres(entity, place_m[None], radius_m, colour)
    for name, place_m, kind in blocks.marked():
        words = f"{name} {kind}"
        _add_text(entity, words, place_m + shapes.ABOVE_M, shapes.BLOCK_COLOURS[kind])
    return update


def _log(sentence: Sentence) -> Any:
    return Log_pb2.Log(
        timestamp=_stamp(sentence.moment),
        level=_LEVELS[sentence.level],
        name=sentence.who,
        message=sentence.text,
    )


def _quaternion(x: float, y: float, z: float, w: float) -> Any:
    return Quaternion_pb2.Quaternion(x=x, y=y, z=z, w=w)


def _add_entity(update: Any, name: str, moment: Moment) -> Any:
    """Add an entity that replaces the one of its name before it, and stays until replaced."""
    return update.entities.add(timestamp=_stamp(moment), frame_id=WORLD, id=name)


def _add_triangles(
    entity: Any, places_m: FloatArray, rgb: palette.ColourArray, indices: list[int]
) -> None:
    primitive = entity.triangles.add(pose=_pose(), indices=indices)
    extend(primitive, "points", places_m)
    opaque = np.ones((len(rgb), 1))
    extend(primitive, "colors", np.concatenate([rgb / 255.0, opaque], axis=1))


def _add_spheres(entity: Any, places_m: FloatArray, radius_m: float, colour: str) -> None:
    size, shade = _vector(*[2.0 * radius_m] * 3), _colour(colour)
    for place_m in places_m.tolist():
        entity.spheres.add(pose=_pose(place_m), size=size, color=shade)


def _add_line(entity: Any, places_m: FloatArray, radius_m: float, colour: str) -> None:
    line = entity.lines.add(
        type=LinePrimitive_pb2.LinePrimitive.LINE_STRIP,
        pose=_pose(),
        thickness=2.0 * radius_m,
        color=_colour(colour),
    )
    extend(line, "points", places_m)


def _add_text(entity: Any, text: str, place_m: Iterable[float], colour: str) -> None:
    entity.texts.add(
        pose=_pose(place_m),
        billboard=True,
        font_size=14.0,
        scale_invariant=True,
        color=_colour(colour),
        text=text,
    )


def _stamp(moment: Moment) -> Timestamp:
    seconds, nanoseconds = divmod(moment.stamp_ns, 1_000_000_000)
    return Timestamp(seconds=seconds, nanos=nanoseconds)


def _vector(x: float, y: float, z: float) -> Any:
    return Vector3_pb2.Vector3(x=x, y=y, z=z)


def _pose(place_m: Iterable[float] = (0.0, 0.0, 0.0)) -> Any:
    return Pose_pb2.Pose(position=_vector(*place_m), orientation=_NO_TURN)


def _colour(text: str) -> Any:
    red, green, blue = palette.rgb(text)
    return Color_pb2.Color(r=red / 255.0, g=green / 255.0, b=blue / 255.0, a=1.0)
