"""Questions and answers, the same on both buses."""

import time
from collections.abc import Callable
from typing import Any

import pytest

from fras_common.bus import Bus, NoAnswer, RemoteFault
from fras_common.codec import MalformedMessage
from fras_common.errors import FrasError
from fras_common.messages import ExecuteReply, HoldRequest, HoldState, TargetReply, TargetRequest
from fras_common.topics import EXECUTE, HOLD, SA_TARGET, Query

Open = Callable[..., Bus]
Listen = Callable[[], Any]

REQUEST = TargetRequest(trial="t", action="reach", arm="psm1", block="b(1,1)")
REPLY = TargetReply(position_m=(0.01, 0.02, 0.03))


class Unreachable(FrasError):
    pass


def served(asker: Bus, query: Query[Any, Any], request: Any) -> Any:
    """Ask until the queryable, which takes its time to be known, answers."""
    deadline = time.monotonic() + 10.0
    while True:
        try:
            return asker.query(query, request, 5.0)
        except NoAnswer:
            if time.monotonic() > deadline:
                raise


def test_a_query_gets_its_reply(open_bus: Open):
    asked: list[TargetRequest] = []

    def answer(call: Any) -> None:
        asked.append(call.request)
        call.reply(REPLY)

    open_bus("sa/1").serve(SA_TARGET, answer)
    assert served(open_bus("motion/1"), SA_TARGET, REQUEST) == REPLY
    assert asked == [REQUEST]


def test_each_query_finds_its_own_server(open_bus: Open):
    holds = HoldState(holds={"surgeon": "bleeding"}, tick=7)
    open_bus("sa/1").serve(SA_TARGET, lambda call: call.reply(REPLY))
    open_bus("motion/1").serve(HOLD, lambda call: call.reply(holds))
    asker = open_bus("planner/1")
    assert served(asker, SA_TARGET, REQUEST) == REPLY
    assert served(asker, HOLD, HoldRequest(holder="surgeon", reason="bleeding")) == holds


def test_a_typed_error_keeps_its_kind_and_text(open_bus: Open):
    open_bus("sa/1").serve(
        SA_TARGET, lambda call: call.fail(Unreachable("b(1,1) lies beyond psm1: ask psm2"))
    )
    with pytest.raises(RemoteFault, match=r"b\(1,1\) lies beyond psm1: ask psm2") as caught:
        served(open_bus("motion/1"), SA_TARGET, REQUEST)
    assert caught.value.remote_kind == "Unreachable"
    assert caught.value.values["key"] == "sa/target"


def test_the_answer_may_come_later_and_out_of_order(open_bus: Open, listen: Listen):
    waiting, outcomes = listen(), listen()
    open_bus("sa/1").serve(SA_TARGET, waiting)
    asker = open_bus("motion/1")
    while not waiting:
        asker.ask(SA_TARGET, REQUEST, lambda _: None, 0.05)
        try:
            waiting.until(bool, timeout_s=0.05)
        except AssertionError:
            continue
    known = len(waiting)
    for number in range(2):
        request = TargetRequest(trial="t", action="move", arm="psm1", block=str(number))
        asker.ask(SA_TARGET, request, outcomes, 10.0)
    calls = {
        call.request.block: call
        for call in waiting.until(lambda got: sum(c.request.action == "move" for c in got) == 2)[
            known:
        ]
        if call.request.action == "move"
    }
    calls["1"].reply(TargetReply(position_m=(1.0, 1.0, 1.0)))
    outcomes.count(1)
    calls["0"].reply(TargetReply(position_m=None))
    assert [reply.position_m for reply in outcomes.count(2)] == [(1.0, 1.0, 1.0), None]


def test_asking_does_not_wait(open_bus: Open, listen: Listen):
    waiting, outcomes = listen(), listen()
    open_bus("sa/1").serve(SA_TARGET, waiting)
    asker = open_bus("motion/1")
    while not waiting:
        outcomes.clear()
        since = time.monotonic()
        asker.ask(SA_TARGET, REQUEST, outcomes, 60.0)
        assert time.monotonic() - since < 1.0
        try:
            waiting.until(bool, timeout_s=0.05)
        except AssertionError:
            continue
    assert outcomes == []
    waiting[0].reply(REPLY)
    assert outcomes.count(1) == [REPLY]


def test_without_a_server_there_is_no_answer(open_bus: Open):
    with pytest.raises(NoAnswer, match="sa/target: nobody answered, 2"):
        open_bus("motion/1").query(SA_TARGET, REQUEST, 2.0)


def test_a_silent_server_gives_no_answer_in_time(open_bus: Open, listen: Listen):
    kept = listen()
    open_bus("sa/1").serve(SA_TARGET, kept)
    asker = open_bus("motion/1")
    since = 0.0
    for _ in range(100):
        since = time.monotonic()
        with pytest.raises(NoAnswer) as caught:
            asker.query(SA_TARGET, REQUEST, 0.3)
        assert caught.value.values == {"key": "sa/target", "timeout_s": 0.3}
        if kept:
            break
    assert len(kept) == 1
    assert 0.2 < time.monotonic() - since < 1.5


def test_a_server_that_left_gives_no_answer(open_bus: Open):
    server, asker = open_bus("sa/1"), open_bus("motion/1")
    server.serve(SA_TARGET, lambda call: call.reply(REPLY))
    served(asker, SA_TARGET, REQUEST)
    server.close()
    with pytest.raises(NoAnswer):
        asker.query(SA_TARGET, REQUEST, 0.5)


def test_closing_ends_the_questions_still_open(open_bus: Open, listen: Listen):
    kept, outcomes = listen(), listen()
    open_bus("sa/1").serve(SA_TARGET, kept)
    asker = open_bus("motion/1")
    while not kept:
        asker.ask(SA_TARGET, REQUEST, outcomes, 60.0)
        try:
            kept.until(bool, timeout_s=0.05)
        except AssertionError:
            continue
    since = time.monotonic()
    asker.close()
    assert all(isinstance(outcome, NoAnswer) for outcome in outcomes.count(1))
    assert time.monotonic() - since < 5.0


def test_a_malformed_request_is_refused_and_counted_and_never_delivered(
    open_bus: Open, listen: Listen
):
    refused, calls = listen(), listen()
    open_bus("sa/1", on_malformed=refused).serve(SA_TARGET, calls)
    wrong: Query[Any, Any] = Query("sa/target", HoldRequest, TargetReply, "sa")
    with pytest.raises(RemoteFault) as caught:
        served(open_bus("motion/1"), wrong, HoldRequest(holder="me", reason=""))
    assert caught.value.remote_kind == "MalformedMessage"
    (error,) = refused.count(1)
    assert isinstance(error, MalformedMessage)
    assert error.values["key"] == "sa/target"
    assert calls == []


@pytest.mark.parametrize("value", [float("nan"), float("inf"), float("-inf")])
def test_a_command_that_is_not_finite_is_refused(open_bus: Open, listen: Listen, value: float):
    refused, calls = listen(), listen()
    open_bus("motion/1", on_malformed=refused).serve(EXECUTE, calls)
    loose: Query[Any, Any] = Query("motion/execute", dict, ExecuteReply, "motion")
    command = {"trial": "t", "goal_id": "1", "name": "reach", "arm": "psm1", "block": "b(1,1)"}
    with pytest.raises(RemoteFault, match="target_m is not finite"):
        served(open_bus("planner/1"), loose, command | {"target_m": [0.0, value, 0.0]})
    refused.count(1)
    assert calls == []


def test_a_malformed_reply_is_an_error_of_its_own(open_bus: Open):
    wrong: Query[Any, Any] = Query("sa/target", TargetRequest, HoldState, "sa")
    open_bus("sa/1").serve(wrong, lambda call: call.reply(HoldState(holds={}, tick=1)))
    with pytest.raises(MalformedMessage, match="sa/target"):
        served(open_bus("motion/1"), SA_TARGET, REQUEST)


def test_queries_stay_within_their_cell(open_bus: Open):
    open_bus("sa/1", cell="two").serve(SA_TARGET, lambda call: call.reply(REPLY))
    assert served(open_bus("motion/2", cell="two"), SA_TARGET, REQUEST) == REPLY
    with pytest.raises(NoAnswer):
        open_bus("motion/1", cell="one").query(SA_TARGET, REQUEST, 0.5)


def test_only_the_first_outcome_counts(open_bus: Open, listen: Listen):
    outcomes, kept = listen(), listen()
    open_bus("sa/1").serve(SA_TARGET, kept)
    asker = open_bus("motion/1")
    while not kept:
        outcomes.clear()
        asker.ask(SA_TARGET, REQUEST, outcomes, 0.2)
        outcomes.count(1)
    kept[0].reply(REPLY)
    # A later exchange has come and gone: the late reply would have been here before it.
    again = listen()
    asker.ask(SA_TARGET, REQUEST, again, 5.0)
    kept.count(2)[-1].reply(REPLY)
    again.count(1)
    assert [type(outcome) for outcome in outcomes] == [NoAnswer]
