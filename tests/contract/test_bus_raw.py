"""Bytes as they are: what a log is replayed with; and who is there, asked once."""

from collections.abc import Callable
from typing import Any

import pytest

from fras_common.bus import Bus, NoAnswer
from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.codec import encode
from fras_common.messages import RecorderStatus
from fras_common.topics import RECORDER_STATUS, Qos

# Fixtures of conftest.py, whose classes can't be imported from here.
Open = Callable[..., Bus]
Listen = Callable[[], Any]

ANY = "patient/tissue_state"
TEXT = "text/plain;utf-8"
PACKED = "application/msgpack"
MARK = "log/mark"


def status(messages: int) -> RecorderStatus:
    return RecorderStatus(
        stamp_ns=5, seq=77, source="recorder/old", trial="t", state="recording", path="",
        messages=messages, bytes=0, lost=0, reason="",
    )  # fmt: skip


def ask_for_ever(bus: Bus) -> None:
    """Ask until the connection is known to be gone."""
    while True:
        assert bus.tokens(0.5) == frozenset()


def test_payload_and_encoding_arrive_as_they_were_put(open_bus: Open, listen: Listen):
    heard = listen()
    open_bus("recorder/1").subscribe_raw("**", heard)
    publisher = open_bus("replay/1").publisher_raw(ANY, Qos.STATE)
    sent = [
        (bytes([number % 256]) * number, TEXT if number % 2 else PACKED) for number in range(300)
    ]
    for payload, encoding in sent:
        publisher.put(payload, encoding)
    got = heard.count(300)
    assert [(s.key, s.payload, s.encoding) for s in got] == [(ANY, *one) for one in sent]


def test_a_typed_subscriber_gets_the_header_of_who_sent_it_first(open_bus: Open, listen: Listen):
    heard = listen()
    publisher = open_bus("replay/1").publisher_raw(RECORDER_STATUS.key, Qos.EVENT)
    publisher.put(encode(status(1)), PACKED)
    publisher.put(encode(status(2)), PACKED)
    open_bus("cli/1").subscribe(RECORDER_STATUS, heard)
    assert heard.count(1)[0] == status(2)


@pytest.mark.parametrize("qos", Qos)
def test_who_comes_later_gets_what_the_class_keeps(open_bus: Open, listen: Listen, qos: Qos):
    late = listen()
    bus = open_bus("replay/1")
    publisher, mark = bus.publisher_raw(ANY, qos), bus.publisher_raw(MARK, Qos.STATE)
    publisher.put(b"before", PACKED)
    mark.put(b"", PACKED)
    bus.tokens(5.0)
    open_bus("recorder/1").subscribe_raw("**", late)
    late.until(lambda got: any(sample.key == MARK for sample in got))
    kept = qos in (Qos.STATE, Qos.EVENT)
    if kept:
        late.until(lambda got: any(sample.key == ANY for sample in got))
    assert any(sample.key == ANY for sample in late) == kept


def test_a_closed_one_forgets_what_it_kept(open_bus: Open, listen: Listen):
    late = listen()
    bus = open_bus("replay/1")
    publisher, mark = bus.publisher_raw(ANY, Qos.EVENT), bus.publisher_raw(MARK, Qos.STATE)
    publisher.put(b"of the future", PACKED)
    mark.put(b"", PACKED)
    publisher.close()
    publisher.close()
    again = bus.publisher_raw(ANY, Qos.EVENT)
    bus.tokens(5.0)
    open_bus("cli/1").subscribe_raw("**", late)
    late.until(lambda got: any(sample.key == MARK for sample in got))
    again.put(b"new", PACKED)
    late.until(lambda got: any(sample.key == ANY for sample in got))
    assert [sample.payload for sample in late if sample.key == ANY] == [b"new"]


def test_who_is_there_is_told_at_once_and_whole(open_bus: Open):
    asking = open_bus("replay/1")
    assert asking.tokens(5.0) == frozenset()
    others = [open_bus(f"sim/{number}") for number in range(5)]
    for other in others:
        other.announce("alive/sim")
        other.tokens(5.0)
    asking.announce("alive/replay")
    everyone = {f"alive/sim/{number}" for number in range(5)} | {"alive/replay/1"}
    assert asking.tokens(5.0) == everyone
    others[0].close()
    open_bus("sa/1", cell="two").announce("ready/sa")
    assert "ready/sa/1" not in asking.tokens(5.0)


def test_without_a_router_nobody_answers_who_is_there(own_router: Any):
    bus = ZenohBus("one", own_router.endpoint, "replay/1")
    try:
        assert bus.tokens(5.0) == frozenset()
        own_router.stop()
        with pytest.raises(NoAnswer):
            ask_for_ever(bus)
    finally:
        bus.close()
        own_router.start()
