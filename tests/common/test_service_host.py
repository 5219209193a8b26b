"""The host of a service: one inbox, one loop, mirrors, counts, readiness, health."""

import threading
from collections.abc import Callable
from typing import Any

import pytest
from structlog.testing import capture_logs

from fras_common.bus import RemoteFault
from fras_common.codec import decode
from fras_common.errors import FrasError
from fras_common.messages import (
    HoldRequest,
    Holds,
    HoldState,
    LogRecord,
    RpcRecord,
    TargetReply,
    TargetRequest,
    Verdict,
)
from fras_common.service import Deferred, ServiceHost
from fras_common.service.health import ProcessMeter
from fras_common.service.host import INBOX
from fras_common.topics import HOLD, HOLDS, LOG, RPC, SA_TARGET, TASK_STATUS, VERDICT, Qos, Topic
from support.verdicts import verdict

Ask = Callable[..., list[Any]]

REQUEST = TargetRequest(trial="t", action="reach", arm="psm1", block="b(1,1)")
REPLY = TargetReply(position_m=(0.1, 0.2, 0.3))


class Unreachable(FrasError):
    pass


def refuse(_: TargetRequest) -> TargetReply:
    raise Unreachable("b(1,1) lies beyond psm1")


# --- inbox ------------------------------------------------------------------------------------


def test_messages_are_handled_by_the_loop_in_order_of_arrival(bench: Any):
    host = bench.host("motion")
    handled: list[tuple[str, int]] = []
    host.subscribe(VERDICT, lambda message: handled.append(("verdict", message.tick)))
    host.subscribe(LOG, lambda message: handled.append((message.event, message.seq)))
    host.enter_trial("t-1")
    bus = bench.bus("sa/1")
    verdicts, logs = bus.publisher(VERDICT), bus.publisher(LOG.of(service="sa"))
    verdicts.put(verdict(0))
    logs.put(LogRecord(level="warning", event="late", fields={}))
    verdicts.put(verdict(1))
    assert handled == []
    bench.settle()
    assert handled == [("verdict", 0), ("late", 0), ("verdict", 1)]
    assert host.health(ProcessMeter()).received == 3


def test_what_has_no_room_is_dropped_and_counted_and_costs_no_other_key(bench: Any):
    host = bench.host("planner")
    handled: list[str] = []
    host.subscribe(LOG, lambda message: handled.append(message.event))
    host.subscribe(HOLDS, lambda message: handled.append("holds"))
    flood = bench.bus("sim/1").publisher(LOG.of(service="sim"))
    for number in range(INBOX + 7):
        flood.put(LogRecord(level="warning", event=str(number), fields={}))
    bench.bus("motion/1").publisher(HOLDS).put(Holds(holds={}))
    assert host.health(ProcessMeter()).queue_depth == INBOX + 1
    bench.settle()
    assert handled == [*map(str, range(INBOX)), "holds"]
    assert host.health(ProcessMeter()).queue_dropped == 7
    assert host.health(ProcessMeter()).queue_depth == 0
    # There is room again.
    flood.put(LogRecord(level="warning", event="later", fields={}))
    bench.settle()
    assert handled[-1] == "later"


def test_what_a_service_asked_for_is_never_dropped(bench: Any):
    host = bench.host("planner")
    bench.host("sa").serve(SA_TARGET, lambda request: REPLY)
    host.subscribe(LOG, lambda message: None)
    flood = bench.bus("sim/1").publisher(LOG.of(service="sim"))
    for _ in range(INBOX + 1):
        flood.put(LogRecord(level="warning", event="flood", fields={}))
    answers: list[Any] = []
    host.bus.ask(SA_TARGET, REQUEST, lambda answer: host.post(lambda: answers.append(answer)), 5.0)
    bench.settle()
    assert answers == [REPLY]


def test_the_loop_stops_even_when_its_inbox_is_full(bench: Any):
    host = bench.host("motion")
    started, release = threading.Event(), threading.Event()
    host.post(lambda: (started.set(), release.wait(10.0)))
    loop = threading.Thread(target=host.run, args=(lambda: None,))
    loop.start()
    assert started.wait(10.0)
    for _ in range(INBOX + 1):
        host.post(lambda: None)
    host.stop()
    release.set()
    loop.join(10.0)
    assert not loop.is_alive()


def test_the_loop_wakes_when_it_was_told_to(bench: Any):
    host = bench.host("motion")
    woken: list[int] = []

    def wake() -> float | None:
        woken.append(len(woken))
        if len(woken) == 3:
            host.stop()
        return 0.001

    host.run(wake)
    assert woken == [0, 1, 2]


def test_drain_says_whether_there_was_a_job(bench: Any):
    host = bench.host("motion")
    bench.settle()
    assert not host.drain(0.0)
    host.post(lambda: None)
    assert host.drain(0.0)


def test_without_a_bus_the_host_says_so():
    with pytest.raises(FrasError, match="attach first"):
        _ = ServiceHost("sim").bus


# --- trials and gaps --------------------------------------------------------------------------


def test_messages_of_another_trial_wait_or_are_dropped(bench: Any):
    host = bench.host("motion")
    handled: list[tuple[str, int]] = []
    host.subscribe(VERDICT, lambda message: handled.append((message.trial, message.tick)))
    publisher = bench.bus("sa/1").publisher(VERDICT)
    host.enter_trial("t-1")
    publisher.put(verdict(8, "t-1"))
    publisher.put(verdict(0, "t-2"))
    publisher.put(verdict(9, "t-0"))
    bench.settle()
    assert handled == [("t-1", 8)]
    host.enter_trial("t-2")
    assert handled == [("t-1", 8), ("t-2", 0)]
    health = host.health(ProcessMeter())
    assert (health.wrong_trial, health.gaps, health.received) == (1, 0, 2)
    assert (health.trial, health.tick) == ("t-2", -1)


def test_a_topic_outside_trials_passes_at_any_time(bench: Any):
    host = bench.host("cli")
    handled: list[Any] = []
    host.enter_trial("t-9")
    host.subscribe(LOG, handled.append)
    host.subscribe(TASK_STATUS, handled.append)
    bench.bus("sa/1").publisher(LOG.of(service="sa")).put(
        LogRecord(trial="t-0", level="warning", event="late", fields={})
    )
    bench.settle()
    assert len(handled) == 1


def test_missing_sequence_numbers_are_counted(bench: Any):
    host = bench.host("motion")
    host.subscribe(VERDICT, lambda message: None)
    host.enter_trial("t-1")
    publisher = bench.bus("sa/1").publisher(VERDICT)
    publisher.put(verdict(0))
    for lost in (1, 2):
        # Its sequence number is used up, as if the sample had been lost on the way.
        publisher._stamper.stamp(verdict(lost))  # noqa: SLF001
    publisher.put(verdict(3))
    bench.bus("sa/2").publisher(VERDICT).put(verdict(4))
    bench.settle()
    assert host.health(ProcessMeter()).gaps == 2


def test_what_the_gate_drops_is_no_gap(bench: Any):
    host = bench.host("motion")
    host.subscribe(VERDICT, lambda message: None)
    host.enter_trial("t-1")
    publisher = bench.bus("sa/1").publisher(VERDICT)
    for trial in ("t-1", "t-0", "t-0", "t-1"):
        publisher.put(verdict(0, trial))
    bench.settle()
    assert host.health(ProcessMeter()).gaps == 0


def test_keys_of_one_family_are_no_gaps_to_each_other(bench: Any):
    motion, sa, host = bench.host("motion"), bench.host("sa"), bench.host("cli")
    motion.serve(HOLD, lambda request: HoldState(holds={}, tick=0))
    sa.serve(SA_TARGET, lambda request: REPLY)
    asker = bench.bus("planner/1")

    def ask(query: Any, request: Any) -> None:
        asker.ask(query, request, lambda _: None, 5.0)
        bench.settle()

    for _ in range(5):
        ask(SA_TARGET, REQUEST)
    host.subscribe(RPC, lambda message: None)
    ask(HOLD, HoldRequest(holder="me", reason=""))
    ask(SA_TARGET, REQUEST)
    health = host.health(ProcessMeter())
    assert (health.received, health.gaps) == (2, 0)


def test_a_malformed_message_is_counted_and_logged(bench: Any):
    host = bench.host("motion")
    logged: list[str] = []
    host.log = type("Log", (), {"warning": lambda self, event, problem: logged.append(problem)})()
    host.subscribe(VERDICT, pytest.fail)
    wrong: Topic[Any] = Topic("sa/verdict", LogRecord, "sa", Qos.STATE, "never")
    bench.bus("sa/1").publisher(wrong).put(LogRecord(level="", event="", fields={}))
    bench.settle()
    assert host.health(ProcessMeter()).malformed == 1
    assert logged[0].startswith("sa/verdict: $")


# --- queries ----------------------------------------------------------------------------------


def mirrors(bench: Any) -> list[RpcRecord]:
    return bench.heard(RPC)


def test_a_query_is_answered_by_the_loop_and_mirrored(bench: Any, outcome: Ask):
    host, mirrored = bench.host("sa"), mirrors(bench)
    asked: list[TargetRequest] = []
    host.serve(SA_TARGET, lambda request: (asked.append(request), REPLY)[1])
    host.enter_trial("t-1")
    got = outcome(bench.bus("motion/1"), SA_TARGET, REQUEST)
    assert got == []
    bench.settle()
    assert (got, asked) == ([REPLY], [REQUEST])
    (record,) = mirrored
    assert (record.key, record.trial, record.source) == ("sa/target", "t-1", "sa/1")
    assert decode(TargetRequest, bytes(record.request), "") == REQUEST
    assert decode(TargetReply, bytes(record.reply), "") == REPLY
    assert record.fault is None
    assert 0.0 <= record.duration_s < 10.0


def test_a_refusal_goes_back_typed_and_is_mirrored(bench: Any, outcome: Ask):
    host, mirrored = bench.host("sa"), mirrors(bench)
    host.serve(SA_TARGET, refuse)
    got = outcome(bench.bus("motion/1"), SA_TARGET, REQUEST)
    bench.settle()
    assert isinstance(got[0], RemoteFault)
    assert got[0].remote_kind == "Unreachable"
    (record,) = mirrored
    assert bytes(record.reply) == b"\xc0"
    assert record.fault is not None
    assert (record.fault.kind, record.fault.text) == ("Unreachable", "b(1,1) lies beyond psm1")


def test_an_answer_may_wait_for_what_comes_first(bench: Any, outcome: Ask):
    host, mirrored = bench.host("sa"), mirrors(bench)
    pending: list[Deferred[TargetRequest, TargetReply]] = []
    host.serve_deferred(SA_TARGET, pending.append)
    got = outcome(bench.bus("motion/1"), SA_TARGET, REQUEST)
    bench.settle()
    assert (got, mirrored) == ([], [])
    assert pending[0].request == REQUEST
    pending[0].reply(REPLY)
    bench.settle()
    assert got == [REPLY]
    assert len(mirrored) == 1


def test_a_deferred_answer_may_be_a_fault(bench: Any, outcome: Ask):
    host, mirrored = bench.host("sa"), mirrors(bench)
    host.serve_deferred(SA_TARGET, lambda pending: pending.fail(Unreachable("too late")))
    got = outcome(bench.bus("motion/1"), SA_TARGET, REQUEST)
    bench.settle()
    assert got[0].remote_kind == "Unreachable"
    assert mirrored[0].fault is not None


def test_a_hold_is_answered_while_the_loop_is_stuck(bench: Any):
    host, mirrored = bench.host("motion"), mirrors(bench)
    held: dict[str, str] = {}

    def hold(request: HoldRequest) -> HoldState:
        held[request.holder] = request.reason
        return HoldState(holds=dict(held), tick=4)

    host.serve_at_once(HOLD, hold)
    stuck, release = threading.Event(), threading.Event()
    loop = threading.Thread(target=host.run, args=(lambda: None,))
    loop.start()
    try:
        host.post(lambda: (stuck.set(), release.wait(10.0)))
        assert stuck.wait(10.0)
        reply = bench.bus("cli/1").query(HOLD, HoldRequest(holder="surgeon", reason="stop"), 5.0)
        assert reply == HoldState(holds={"surgeon": "stop"}, tick=4)
        assert mirrored == []
    finally:
        release.set()
        host.post(host.stop)
        loop.join(10.0)
    assert [record.key for record in mirrored] == ["motion/hold"]


def test_a_query_that_meets_our_own_mistake_is_answered_all_the_same(bench: Any, outcome: Ask):
    host, mirrored = bench.host("sa"), mirrors(bench)

    def broken(_: TargetRequest) -> TargetReply:
        raise ZeroDivisionError

    host.serve(SA_TARGET, broken)
    answers = outcome(bench.bus("motion/1"), SA_TARGET, REQUEST, 5.0)
    with capture_logs() as logs:
        bench.settle()
    (error,) = answers
    assert isinstance(error, RemoteFault)
    assert error.remote_kind == "InternalFault"
    assert (logs[0]["log_level"], logs[0]["exc_info"]) == ("error", True)
    fault = mirrored[0].fault
    assert fault is not None
    assert fault.kind == "InternalFault"


@pytest.mark.parametrize(("error", "ends"), [(FrasError("no"), False), (ZeroDivisionError(), True)])
def test_a_handler_may_refuse_a_message_but_not_break(bench: Any, error: Exception, ends: bool):
    """What a message says may be refused; a mistake of our own ends the process, seen by all."""
    host = bench.host("sa")

    def handler(_: Verdict) -> None:
        raise error

    host.subscribe(VERDICT, handler)
    bench.bus("sa/1").publisher(VERDICT).put(verdict(0, trial=""))
    if ends:
        with pytest.raises(ZeroDivisionError):
            bench.settle()
    else:
        bench.settle()
        assert host.counts["refused"] == 1


def test_a_malformed_request_never_reaches_the_handler(bench: Any, outcome: Ask):
    host, mirrored = bench.host("sa"), mirrors(bench)
    host.serve(SA_TARGET, pytest.fail)
    got = outcome(bench.bus("motion/1"), SA_TARGET, HoldRequest(holder="", reason=""))
    bench.settle()
    assert got[0].remote_kind == "MalformedMessage"
    assert host.health(ProcessMeter()).malformed == 1
    assert mirrored == []


def test_what_the_loop_answers_is_mirrored_before_it_is_answered(bench: Any):
    """Nothing that was done upon an answer may stand in a log without it, whoever is killed."""
    host, mirrored = bench.host("sa"), mirrors(bench)
    host.serve(SA_TARGET, lambda request: REPLY)
    told: list[int] = []
    bench.bus("motion/1").ask(SA_TARGET, REQUEST, lambda answer: told.append(len(mirrored)), 5.0)
    host.post(host.stop)
    host.run(lambda: None)
    assert told == [1]
