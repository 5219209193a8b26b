"""A service that is asked too often, too much, or what breaks it: refused, counted, still there."""

from collections.abc import Callable
from typing import Any

import pytest
from structlog.testing import capture_logs

from fras_common.bus import RawSample, RemoteFault
from fras_common.codec import encode
from fras_common.messages import HoldRequest, HoldState, LogRecord, TargetReply, TargetRequest
from fras_common.service import INBOX, Deferred
from fras_common.service.health import ProcessMeter
from fras_common.service.rates import BURST, TOLD_AT_ONCE, WAITING
from fras_common.topics import HOLD, LOG, RPC, SA_TARGET, TASK_STATUS, Qos

Ask = Callable[..., list[Any]]

REQUEST = TargetRequest(trial="t", action="reach", arm="psm1", block="b(1,1)")
REPLY = TargetReply(position_m=None)
MANY = 3_000


@pytest.fixture
def sa(bench: Any) -> Any:
    host = bench.host("sa")
    host.clock = lambda: 0.0
    return host


def kinds(answers: list[Any]) -> set[str]:
    return {one.remote_kind if isinstance(one, RemoteFault) else "reply" for one in answers}


def test_more_questions_than_may_wait_are_refused_at_once_and_counted(
    bench: Any, sa: Any, outcome: Ask
) -> None:
    sa.serve(SA_TARGET, lambda request: REPLY)
    client = bench.bus("cli/1")
    answers = [outcome(client, SA_TARGET, REQUEST) for _ in range(WAITING + 30)]
    assert [len(one) for one in answers] == [0] * WAITING + [1] * 30
    assert kinds([one for (one,) in answers[WAITING:]]) == {"TooManyQueries"}
    bench.settle()
    assert kinds([one for (one,) in answers[:WAITING]]) == {"reply"}
    assert sa.health(ProcessMeter()).refusals == {"too_many_queries": 30}


def test_a_flood_of_questions_keeps_no_message_from_being_handled(
    bench: Any, sa: Any, outcome: Ask
) -> None:
    sa.serve(SA_TARGET, lambda request: REPLY)
    handled: list[int] = []
    mirrored = bench.heard(RPC.of(service="sa", name="target"))
    client, answers = bench.bus("cli/1"), list[Any]()
    with capture_logs() as logs:
        for number in range(MANY):
            answers += outcome(client, SA_TARGET, REQUEST)
            assert sa.waiting <= WAITING + TOLD_AT_ONCE
            if number % 100 == 0:
                sa.post(lambda number=number: handled.append(number))
                bench.settle()
        bench.settle()
    assert handled == list(range(0, MANY, 100))
    refused = sa.refusals["too_many_queries"]
    assert refused >= MANY - BURST - 1
    assert sa.counts["queue_dropped"] == 0
    assert len(mirrored) <= BURST
    assert len([one for one in logs if "asked too often" in one["event"]]) == TOLD_AT_ONCE


def test_after_a_rest_questions_are_answered_again(bench: Any, sa: Any, outcome: Ask) -> None:
    sa.serve(SA_TARGET, lambda request: REPLY)
    client = bench.bus("cli/1")
    for _ in range(BURST):
        outcome(client, SA_TARGET, REQUEST)
        bench.settle()
    assert kinds(outcome(client, SA_TARGET, REQUEST)) == {"TooManyQueries"}
    sa.clock = lambda: 1.0
    answers = outcome(client, SA_TARGET, REQUEST)
    bench.settle()
    assert kinds(answers) == {"reply"}


def test_a_stop_is_never_refused_however_often_it_is_asked_for(bench: Any, outcome: Ask) -> None:
    motion, taken = bench.host("motion"), list[str]()
    motion.clock = lambda: 0.0

    def hold(request: HoldRequest) -> HoldState:
        taken.append(request.holder)
        return HoldState(holds={}, tick=0)

    motion.serve_at_once(HOLD, hold)
    mirrored = bench.heard(RPC.of(service="motion", name="hold"))
    client = bench.bus("rogue/1")
    many = MANY
    for number in range(many):
        (answer,) = outcome(client, HOLD, HoldRequest(holder=f"{number}", reason=""))
        assert isinstance(answer, HoldState)
    assert len(taken) == many
    bench.settle()
    assert len(mirrored) == BURST
    assert motion.refusals["not_mirrored"] == many - BURST
    assert motion.counts["queue_dropped"] == 0


def test_a_flood_of_garbage_is_counted_to_the_last_and_fills_neither_inbox_nor_log(
    bench: Any, sa: Any
) -> None:
    heard: list[int] = []
    sa.subscribe(TASK_STATUS, lambda status: heard.append(1))
    rogue = bench.bus("rogue/1")
    with capture_logs() as logs:
        for _ in range(2 * INBOX):
            rogue.carry_as(Qos.COMMAND, RawSample(TASK_STATUS.key, b"\xc1", ""))
        assert sa.waiting <= TOLD_AT_ONCE
        bench.settle()
        sa.clock = lambda: 5.0
        rogue.carry_as(Qos.COMMAND, RawSample(TASK_STATUS.key, b"\xc1", ""))
        bench.settle()
    assert sa.health(ProcessMeter()).malformed == 2 * INBOX + 1
    assert (sa.counts["queue_dropped"], heard) == (0, [])
    assert len(logs) == TOLD_AT_ONCE + 1
    assert f"{2 * INBOX - TOLD_AT_ONCE} more" in logs[-1]["problem"]


def test_a_question_finds_room_however_many_messages_wait(
    bench: Any, sa: Any, outcome: Ask
) -> None:
    sa.serve(SA_TARGET, lambda request: REPLY)
    sa.subscribe(LOG, lambda message: None)
    flood = bench.bus("sim/1").publisher(LOG.of(service="sim"))
    for _ in range(INBOX + 1):
        flood.put(LogRecord(level="warning", event="flood", fields={}))
    answers = outcome(bench.bus("cli/1"), SA_TARGET, REQUEST)
    bench.settle()
    assert kinds(answers) == {"reply"}
    assert sa.counts["queue_dropped"] == 1


def test_a_deferred_handler_that_breaks_answers_and_ends_nothing(
    bench: Any, sa: Any, outcome: Ask
) -> None:
    def broken(pending: Deferred[TargetRequest, TargetReply]) -> None:
        raise ValueError(pending.request.trial)

    sa.serve_deferred(SA_TARGET, broken)
    answers = outcome(bench.bus("cli/1"), SA_TARGET, REQUEST)
    with capture_logs() as logs:
        bench.settle()
    assert kinds(answers) == {"InternalFault"}
    assert logs[0]["exc_info"]


def test_a_message_longer_than_its_key_allows_is_malformed(bench: Any, outcome: Ask) -> None:
    motion = bench.host("motion")
    motion.serve_at_once(HOLD, lambda request: HoldState(holds={}, tick=0))
    request = HoldRequest(holder="h", reason="x" * HOLD.max_bytes)
    assert len(encode(request)) > HOLD.max_bytes
    (answer,) = outcome(bench.bus("rogue/1"), HOLD, request)
    assert answer.remote_kind == "MalformedMessage"
    assert str(HOLD.max_bytes) in str(answer)
    assert motion.counts["malformed"] == 1
