"""Both buses: a message whose source is none of its key's producers reaches no callback."""

from collections.abc import Callable
from typing import Any

from fras_common.bus import Bus
from fras_common.messages import Holds
from fras_common.topics import HOLDS

Open = Callable[..., Bus]
Listen = Callable[[], Any]


def test_a_message_of_another_source_is_told_and_never_delivered(open_bus: Open, listen: Listen):
    heard, refused, raw = listen(), listen(), listen()
    hearing = open_bus("planner/1", on_malformed=refused)
    hearing.subscribe(HOLDS, heard)
    hearing.subscribe_raw("motion/holds", raw)
    open_bus("sa/1").publisher(HOLDS).put(Holds(holds={"rogue": "me"}))
    (error,) = refused.count(1)
    assert error.kind == "WrongSource"
    assert error.values["source"] == "sa/1"
    open_bus("motion/1").publisher(HOLDS).put(Holds(holds={"cli": "stop"}))
    assert [message.source for message in heard.count(1)] == ["motion/1"]
    raw.count(2)  # who records hears both, and judges itself
