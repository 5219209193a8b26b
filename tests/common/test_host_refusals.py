"""What a host refuses for whose it is or when it was sent: counted, published, told once."""

from typing import Any

import msgspec
from structlog.testing import capture_logs

from fras_common.codec import encode
from fras_common.errors import FrasError
from fras_common.messages import Holds, ServoJaw
from fras_common.service.errors import Sources
from fras_common.service.health import ProcessMeter
from fras_common.service.rates import TOLD_AT_ONCE
from fras_common.topics import CRTK, FAULT, HOLDS, Qos

JAW = CRTK[0].jaw_servo_jp


class Unbelievable(FrasError):
    """What a handler refuses."""


def test_a_message_of_another_service_has_no_effect_and_is_told_once_a_source(bench: Any):
    host = bench.host("planner")
    faults = bench.heard(FAULT)
    heard: list[Holds] = []
    host.subscribe(HOLDS, heard.append)
    rogue, other = bench.bus("sa/9").publisher(HOLDS), bench.bus("client/9").publisher(HOLDS)
    with capture_logs() as logs:
        for _ in range(3):
            rogue.put(Holds(holds={}))
        other.put(Holds(holds={}))
        bench.settle()
    assert heard == []
    health = host.health(ProcessMeter())
    assert (health.refused, health.malformed, health.received) == (4, 0, 0)
    assert health.refusals == {"wrong_source": 4}
    assert [(f.kind, f.key, f.values["source"]) for f in faults] == [
        ("WrongSource", "motion/holds", "sa/9"),
    ] * 3 + [("WrongSource", "motion/holds", "client/9")]
    assert [log["event"] for log in logs] == ["message refused"] * 2
    bench.bus("motion/1").publisher(HOLDS).put(Holds(holds={"cli": "stop"}))
    bench.settle()
    assert [one.holds for one in heard] == [{"cli": "stop"}]


def test_a_command_that_somebody_sends_again_has_no_effect_and_is_told_once_a_source(bench: Any):
    host = bench.host("motion")
    faults = bench.heard(FAULT)
    heard: list[ServoJaw] = []
    host.subscribe(JAW, heard.append)
    client = bench.bus("client/1")
    sent = client.publisher(JAW).put(ServoJaw(jaw_rad=0.2))
    bench.settle()
    rogue = bench.bus("rogue/1").publisher_raw(JAW.key, Qos.COMMAND)
    old = msgspec.structs.replace(sent, stamp_ns=sent.stamp_ns - 60 * 10**9, seq=99)
    with capture_logs() as logs:
        for again in (sent, old, old):
            rogue.put(encode(again), "application/msgpack")
        bench.settle()
    assert heard == [sent]
    assert host.health(ProcessMeter()).refusals == {"stale_command": 3}
    assert [(f.kind, f.key) for f in faults] == [("StaleCommand", JAW.key)] * 3
    assert [log["event"] for log in logs] == ["message refused"]


def test_what_a_handler_refuses_is_told_some_times_a_source_and_counted_to_the_last(bench: Any):
    host = bench.host("planner")
    host.clock = lambda: 0.0
    faults = bench.heard(FAULT)

    def refuse(holds: Holds) -> None:
        raise Unbelievable("they hold nothing")

    host.subscribe(HOLDS, refuse)
    one, other = bench.bus("motion/1").publisher(HOLDS), bench.bus("motion/2").publisher(HOLDS)
    with capture_logs() as logs:
        for _ in range(TOLD_AT_ONCE + 90):
            one.put(Holds(holds={}))
        other.put(Holds(holds={}))
        bench.settle()
        host.clock = lambda: 1.0
        one.put(Holds(holds={}))
        bench.settle()
    assert [log["event"] for log in logs] == [
        *["message refused"] * (TOLD_AT_ONCE + 1),
        "message refused (and 90 more, not told)",
    ]
    assert host.health(ProcessMeter()).refused == len(faults) == TOLD_AT_ONCE + 92
    assert host.health(ProcessMeter()).refusals == {"Unbelievable": TOLD_AT_ONCE + 92}


def test_a_rogue_with_many_names_is_not_told_of_for_ever():
    sources = Sources()
    told = sum(sources.is_first("WrongSource", f"rogue/{n}") for n in range(10 * Sources.MOST))
    assert told == Sources.MOST
