"""Exported files, read by what others made: the stock MCAP reader, Foxglove's schemas, Rerun."""

import importlib
import os
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa
from google.protobuf import unknown_fields
from google.protobuf.message import Message
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from rerun.chunk import RrdReader


class Read(NamedTuple):
    """A message as the file alone tells it, and its times."""

    content: Any
    data: bytes
    schema: str
    log_time_ns: int
    publish_time_ns: int
    sequence: int


def read_foxglove(path: Path) -> dict[str, list[Read]]:
    """Read every message, decoded by the descriptors that the file holds."""
    found: dict[str, list[Read]] = defaultdict(list)
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for schema, channel, message, content in reader.iter_decoded_messages():
            assert schema is not None
            found[channel.topic].append(
                Read(
                    content,
                    message.data,
                    schema.name,
                    message.log_time,
                    message.publish_time,
                    message.sequence,
                )
            )
    return dict(found)


def parse_publicly(read: Read) -> Message:
    """Parse with Foxglove's own package, which must know every field."""
    package, _, name = read.schema.partition(".")
    assert package == "foxglove"
    module = importlib.import_module(f"foxglove_schemas_protobuf.{name}_pb2")
    message: Message = getattr(module, name).FromString(read.data)
    assert_known(message)
    return message


def assert_known(message: Message) -> None:
    """Check a message and all within it for fields that its schema does not name."""
    assert len(unknown_fields.UnknownFieldSet(message)) == 0
    for field, value in message.ListFields():
        if field.message_type is not None:
            for part in [value] if isinstance(value, Message) else value:
                assert_known(part)


def points(rows: Any) -> list[tuple[float, float, float]]:
    return [(row.x, row.y, row.z) for row in rows]


def run_rerun(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Rerun's own command, at a home of its own: it keeps notes there."""
    command = [str(Path(sys.executable).with_name("rerun")), *arguments]
    environment = {**os.environ, "HOME": str(folder), "XDG_CONFIG_HOME": str(folder)}
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def columns_of(chunk: Any) -> dict[str, list[Any]]:
    """Return the columns of a chunk of Rerun's; times in nanoseconds."""
    batch = chunk.to_record_batch()
    found: dict[str, list[Any]] = {}
    for name, column in zip(batch.schema.names, batch.columns, strict=True):
        timed = pa.types.is_timestamp(column.type) or pa.types.is_duration(column.type)
        found[name] = (column.cast(pa.int64()) if timed else column).to_pylist()
    return found


def read_rerun(path: Path) -> tuple[dict[str, dict[str, list[Any]]], dict[str, dict[str, Any]]]:
    """Return what changes, as columns by entity, and what stays."""
    moving: dict[str, dict[str, list[Any]]] = defaultdict(lambda: defaultdict(list))
    staying: dict[str, dict[str, Any]] = defaultdict(dict)
    for chunk in RrdReader(path).stream().to_chunks():
        for name, column in columns_of(chunk).items():
            if chunk.is_static:
                staying[chunk.entity_path][name] = column[0]
            else:
                moving[chunk.entity_path][name] += column
    return moving, staying
