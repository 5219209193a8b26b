"""Commands to an arm: all and in order for whoever listens, none for who comes later."""

from collections.abc import Callable
from typing import Any

import pytest

from fras_common.bus import Bus, RawSample
from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.codec import decode
from fras_common.messages import Holds, LogRecord, ServoJaw
from fras_common.topics import CRTK, HOLDS, LOG, TOPICS, Qos, Topic

# Fixtures of conftest.py, whose classes can't be imported from here.
Open = Callable[..., Bus]
Cached = Callable[..., list[RawSample]]
Listen = Callable[[], Any]

JAW = CRTK[0].jaw_servo_jp
MOTION_LOG = LOG.of(service="motion")
FIRST_NEW = 100.0


def jaw(value: float) -> ServoJaw:
    return ServoJaw(jaw_rad=value)


def record(event: str) -> LogRecord:
    return LogRecord(level="warning", event=event, fields={})


def held_by(holder: str) -> Holds:
    return Holds(holds={holder: "test"})


def put_until_heard(put: Callable[[], object], heard: Any) -> None:
    """Repeat a put until its subscription, which takes its time to reach the publisher, works."""
    before = len(heard)
    for _ in range(500):
        put()
        try:
            heard.until(lambda got: len(got) > before, timeout_s=0.02)
        except AssertionError:
            continue
        return
    raise AssertionError("the subscription never came to work")


def test_what_an_arm_is_told_is_a_command_and_what_it_says_is_not():
    told = {"state_command", "servo_jp", "servo_cp", "move_cp", "jaw/servo_jp"}
    commands = {topic.key for topic in TOPICS if topic.qos is Qos.COMMAND}
    assert commands == {f"{keys.arm}/{name}" for keys in CRTK for name in told}


def test_who_listens_gets_every_command_in_order(open_bus: Open, listen: Listen):
    heard = listen()
    open_bus("arms/1").subscribe(JAW, heard)
    publisher = open_bus("motion/1").publisher(JAW)
    put_until_heard(lambda: publisher.put(jaw(-1.0)), heard)
    for number in range(300):
        publisher.put(jaw(float(number)))
    got = heard.until(lambda got: got[-1].jaw_rad == 299.0)
    assert [m.jaw_rad for m in got if m.jaw_rad >= 0] == [float(number) for number in range(300)]
    assert [m.seq for m in got] == list(range(got[0].seq, got[0].seq + len(got)))


def test_who_comes_later_gets_no_earlier_command(open_bus: Open, listen: Listen, cached: Cached):
    present, late, raw = listen(), listen(), listen()
    open_bus("arms/1").subscribe(JAW, present)
    sender = open_bus("motion/1")
    publisher, latched = sender.publisher(JAW), sender.publisher(HOLDS)
    kept = sender.publisher(MOTION_LOG)
    put_until_heard(lambda: publisher.put(jaw(1.0)), present)
    # What the same participant says on other keys is kept for later, as ever.
    latched.put(held_by("seven"))
    kept.put(record("kept"))

    arms, recorder, states = open_bus("arms/2"), open_bus("recorder/1"), listen()
    arms.subscribe(JAW, late)
    arms.subscribe(HOLDS, states)
    recorder.subscribe_raw("**", raw)
    kept_keys = {sample.key for sample in cached(recorder)}
    assert {MOTION_LOG.key, HOLDS.key} <= kept_keys
    assert JAW.key not in kept_keys
    assert states.count(1)[0].holds == {"seven": "test"}
    put_until_heard(lambda: publisher.put(jaw(FIRST_NEW)), late)
    assert {message.jaw_rad for message in late} == {FIRST_NEW}
    put_until_heard(lambda: publisher.put(jaw(FIRST_NEW)), raw)
    told = [sample for sample in raw if sample.key == JAW.key]
    assert {decode(ServoJaw, sample.payload, sample.key).jaw_rad for sample in told} == {FIRST_NEW}


def test_a_sender_that_keeps_its_commands_moves_nobody_late_either(open_bus: Open, listen: Listen):
    # A stranger's publisher may keep what it likes; the subscriber does not ask for it.
    keeping: Topic[ServoJaw] = Topic(JAW.key, ServoJaw, "client", Qos.EVENT, "never")
    late = listen()
    publisher = open_bus("stranger/1").publisher(keeping)
    publisher.put(jaw(1.0))
    open_bus("arms/1").subscribe(JAW, late)
    put_until_heard(lambda: publisher.put(jaw(FIRST_NEW)), late)
    assert {message.jaw_rad for message in late} == {FIRST_NEW}


@pytest.mark.parametrize("who_is_new", ["nobody", "arms"])
def test_what_was_told_while_the_router_was_away_moves_nothing_later(
    own_router: Any, listen: Listen, who_is_new: str
):
    heard, kept = listen(), listen()
    sending = ZenohBus("one", own_router.endpoint, "motion/1")
    hearing = ZenohBus("one", own_router.endpoint, "arms/1")
    buses = [sending, hearing]
    try:
        hearing.subscribe(JAW, heard)
        hearing.subscribe(MOTION_LOG, kept)
        publisher, log = sending.publisher(JAW), sending.publisher(MOTION_LOG)
        put_until_heard(lambda: publisher.put(jaw(-1.0)), heard)
        put_until_heard(lambda: log.put(record("warm-up")), kept)
        own_router.stop()
        for number in range(50):
            publisher.put(jaw(float(number)))
            log.put(record("away"))
        own_router.start()
        if who_is_new == "arms":
            heard = listen()
            buses.append(ZenohBus("one", own_router.endpoint, "arms/2"))
            buses[-1].subscribe(JAW, heard)
        # The connection is back when what is kept for it has come.
        put_until_heard(lambda: log.put(record("back")), kept)
        kept.until(lambda got: sum(message.event == "away" for message in got) == 50)
        put_until_heard(lambda: publisher.put(jaw(FIRST_NEW)), heard)
        assert {message.jaw_rad for message in heard} <= {-1.0, FIRST_NEW}
    finally:
        for bus in buses:
            bus.close()
