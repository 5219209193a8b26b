"""The numbers to plot as a protobuf of their own, described at run time: no compiler needed.

Viewers plot fields of a protobuf, but not those of JSON or MessagePack; of the public schemas none
holds named numbers.
"""

from typing import Any, Final

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2
from google.protobuf.message import Message

NUMBERS: Final = (
    "force_n",
    "limit_n",
    "hard_limit_n",
    "visibility",
    "threshold",
    "tick_ms",
    "solve_ms",
)
_FIELD = descriptor_pb2.FieldDescriptorProto


def gauges_class() -> type[Message]:
    """Return the class of the message `fras.Gauges`."""
    file = descriptor_pb2.FileDescriptorProto(
        name="fras/gauges.proto",
        package="fras",
        syntax="proto3",
        dependency=[timestamp_pb2.DESCRIPTOR.name],
    )
    message = file.message_type.add(name="Gauges")
    message.field.add(
        name="timestamp",
        number=1,
        type=_FIELD.TYPE_MESSAGE,
        label=_FIELD.LABEL_OPTIONAL,
        type_name=".google.protobuf.Timestamp",
    )
    optional = _FIELD.LABEL_OPTIONAL
    message.field.add(name="tick", number=2, type=_FIELD.TYPE_INT64, label=optional)
    for number, name in enumerate(NUMBERS, start=3):
        message.field.add(name=name, number=number, type=_FIELD.TYPE_DOUBLE, label=optional)
    # The pool of the public schemas: their Timestamp is the one that this field takes.
    pool: Any = descriptor_pool.Default()
    pool.AddSerializedFile(file.SerializeToString())
    found: Any = message_factory.GetMessageClass(pool.FindMessageTypeByName("fras.Gauges"))
    return found
