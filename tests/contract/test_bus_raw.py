"""Bytes as they are: what a log is replayed with; and who is there, asked once."""

from collections import Counter
from collections.abc import Callable
from typing import Any

import pytest

from fras_common.bus import Bus, NoAnswer, RawSample
from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.codec import encode
from fras_common.keeping import kept_of
from fras_common.messages import RecorderStatus
from fras_common.topics import RECORDER_STATUS, Qos

# Fixtures of conftest.py, whose classes can't be imported from here.
Open = Callable[..., Bus]
Cached = Callable[..., list[RawSample]]
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
def test_who_comes_later_gets_what_the_class_keeps(open_bus: Open, cached: Cached, qos: Qos):
    bus = open_bus("replay/1")
    bus.publisher_raw(ANY, qos).put(b"before", PACKED)
    bus.publisher_raw(MARK, Qos.STATE).put(b"", PACKED)
    bus.tokens(5.0)
    found = cached(open_bus("recorder/1"))
    assert any(sample.key == MARK for sample in found)
    assert any(sample.key == ANY for sample in found) == (qos in (Qos.STATE, Qos.EVENT))


def test_a_closed_one_forgets_what_it_kept(open_bus: Open, cached: Cached):
    bus, late = open_bus("replay/1"), open_bus("cli/1")
    publisher = bus.publisher_raw(ANY, Qos.EVENT)
    publisher.put(b"of the future", PACKED)
    publisher.close()
    publisher.close()
    again = bus.publisher_raw(ANY, Qos.EVENT)
    bus.tokens(5.0)
    assert cached(late) == []
    again.put(b"new", PACKED)
    bus.tokens(5.0)
    assert [sample.payload for sample in cached(late)] == [b"new"]


def test_of_many_publishers_all_that_is_cached_is_told_in_their_order(
    open_bus: Open, cached: Cached
):
    buses = [open_bus(f"sim/{number}") for number in range(2)]
    keys = [f"some/key{number}" for number in range(12)]
    publishers = [(key, bus.publisher_raw(key, Qos.STATE)) for key in keys for bus in buses]
    for number in range(100):
        for _, publisher in publishers:
            publisher.put(bytes([number]) * 500, PACKED)
    for bus in buses:
        bus.tokens(5.0)
    late = open_bus("recorder/1")
    found = cached(late)
    assert len(found) == 12 * 2 * 100
    for key in keys:
        got = [sample.payload[0] for sample in found if sample.key == key]
        # Each publisher's in their order, whatever stands between.
        first = [got.index(number) for number in range(100)]
        assert first == sorted(first)
        assert Counter(got) == dict.fromkeys(range(100), 2)
    assert {sample.key for sample in cached(late, "some/key3")} == {"some/key3"}


def test_a_cache_larger_than_one_answer_comes_whole_and_in_order(open_bus: Open, cached: Cached):
    bus = open_bus("sim/1")
    large, small = (bus.publisher_raw(key, Qos.STATE) for key in ("sim/tissue_state", "sa/verdict"))
    kept = kept_of("sim/tissue_state")
    for number in range(kept + 200):
        large.put(number.to_bytes(4, "big") * 2_000, PACKED)
        small.put(number.to_bytes(4, "big"), PACKED)
    bus.tokens(5.0)
    found = cached(open_bus("recorder/1"))
    for key in ("sim/tissue_state", "sa/verdict"):
        numbers = [int.from_bytes(s.payload[:4], "big") for s in found if s.key == key]
        assert numbers == list(range(200, kept + 200)), key


def test_who_begins_to_listen_in_mid_stream_misses_nothing_from_then_on(
    open_bus: Open, listen: Listen, cached: Cached
):
    bus = open_bus("sim/1")
    publishers = [bus.publisher_raw(f"some/key{number}", Qos.STATE) for number in range(12)]

    def put(number: int) -> None:
        for publisher in publishers:
            publisher.put(bytes([number]), PACKED)

    for number in range(100):
        put(number)
    heard, late = listen(), open_bus("recorder/1")
    late.subscribe_raw("some/**", heard)
    for number in range(100, 130):
        put(number)
    past = cached(late, "some/**")
    for number in range(130, 160):
        put(number)
    last = 12 * 30
    heard.until(lambda got: len([s for s in got if s.payload[0] >= 130]) >= last)
    for number in range(12):
        key = f"some/key{number}"
        told = [s.payload[0] for s in [*past, *heard] if s.key == key]
        assert sorted(set(told)) == list(range(160)), key


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
