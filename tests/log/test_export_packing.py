"""Many small messages at once are the same as one by one, and what does not fit is refused."""

import numpy as np
import pytest
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.TriangleListPrimitive_pb2 import TriangleListPrimitive

from fras_log.export.packing import extend


def test_rows_become_the_same_messages_as_one_by_one() -> None:
    rng = np.random.default_rng(0)
    places, colours = rng.normal(size=(50, 3)), rng.uniform(size=(50, 4))
    places[0] = 0.0
    packed = TriangleListPrimitive(indices=[0, 1, 2])
    extend(packed, "points", places)
    extend(packed, "colors", colours)
    single = TriangleListPrimitive(
        indices=[0, 1, 2],
        points=[Point3(x=x, y=y, z=z) for x, y, z in places.tolist()],
        colors=[Color(r=r, g=g, b=b, a=a) for r, g, b, a in colours.tolist()],
    )
    assert packed == single
    assert packed.SerializeToString() == single.SerializeToString()


def test_they_come_behind_what_is_there() -> None:
    message = TriangleListPrimitive(points=[Point3(x=9.0)])
    extend(message, "points", np.ones((1, 3)))
    assert [point.x for point in message.points] == [9.0, 1.0]
    extend(message, "points", np.empty((0, 3)))
    assert len(message.points) == 2


@pytest.mark.parametrize("columns", [2, 4])
def test_rows_of_another_width_are_refused(columns: int) -> None:
    with pytest.raises(ValueError, match="points does not take rows"):
        extend(TriangleListPrimitive(), "points", np.ones((2, columns)))


def test_fields_that_are_not_doubles_are_refused() -> None:
    with pytest.raises(ValueError, match="entities does not take rows"):
        extend(SceneUpdate(), "entities", np.ones((2, 13)))
    with pytest.raises(ValueError, match="message does not take rows"):
        extend(Log(), "message", np.ones((2, 1)))
