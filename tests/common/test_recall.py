"""What a service recalls: questions asked one after the other, each until it is answered."""

import time
from collections.abc import Iterator
from typing import Any

import pytest

from fras_common.bus import Call, MemoryBus, MemoryFabric
from fras_common.codec import MalformedMessage, encode
from fras_common.errors import FrasError
from fras_common.messages import (
    Holds,
    LastReply,
    LastRequest,
    RobotState,
    SinceReply,
    SinceRequest,
)
from fras_common.service import ServiceHost
from fras_common.service.recall import Last, LastAsked, Recall, Recalling, Since
from fras_common.topics import HOLDS, RECORDER_LAST, RECORDER_SINCE, ROBOT_STATE, SIM_RESET
from support.robots import robot

TURNS = 200


class Bench:
    """One host that recalls, and a client that plays the recorder."""

    def __init__(self) -> None:
        fabric = MemoryFabric()
        self.client = MemoryBus(fabric, "cell", "recorder/test")
        self.host = ServiceHost("sim")
        self.host.attach(MemoryBus(fabric, "cell", "sim/test"))
        self.asked: list[Any] = []
        self.answers: list[Any] = []
        self.tokens: list[str] = []
        self.got: list[Any] = []
        self.taken: list[Any] = []
        self.client.watch_tokens(lambda token, present: self.tokens.append(token))
        self.client.serve(RECORDER_LAST, self._answer)
        self.client.serve(RECORDER_SINCE, self._answer)
        self.host.announce_alive()

    def _answer(self, call: Call[Any, Any]) -> None:
        self.asked.append(call.request)
        answer = self.answers.pop(0)
        if isinstance(answer, FrasError):
            call.fail(answer)
        else:
            call.reply(answer)

    def questions(self, *questions: Any) -> Recalling:
        for question in questions:
            try:
                self.got.append((yield question))
            except MalformedMessage as error:
                self.got.append(error)
        return len(questions)

    def run(self, recalling: Recalling) -> Recall:
        recall = Recall(self.host, recalling, self.taken.append)
        self.client.announce("alive/recorder")
        for _ in range(TURNS):
            if recall.is_done:
                return recall
            wait_s = recall.wake(time.monotonic())
            self.host.drain(wait_s if wait_s is not None else 0.0)
        raise AssertionError("never done")

    @property
    def ready(self) -> bool:
        return any(token.startswith("ready/sim") for token in self.tokens)


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.host.bus.close()
    made.client.close()


def page(*ticks: int, more: bool = False) -> SinceReply:
    payloads = [encode(robot(tick, seq=tick)) for tick in ticks]
    return SinceReply(payloads=payloads, forgotten=False, more=more)


def test_each_question_is_sent_what_was_remembered(bench: Bench) -> None:
    holds = Holds(holds={"cli": "stop"}, seq=4)
    bench.answers = [LastReply(payload=encode(holds)), LastReply(payload=b""), page(3, 4)]
    bench.run(bench.questions(Last(HOLDS), LastAsked(SIM_RESET), Since(ROBOT_STATE, 3)))
    assert bench.got == [holds, None, [robot(3, seq=3), robot(4, seq=4)]]
    assert bench.asked == [
        LastRequest(key="motion/holds"),
        LastRequest(key="rpc/sim/reset"),
        SinceRequest(key="robot/state", tick=3),
    ]
    assert bench.taken == [3]
    assert bench.ready


def test_what_did_not_fit_is_asked_for_and_taken_once(bench: Bench) -> None:
    bench.answers = [page(3, 4, more=True), page(4, 5, more=True), page(5, 6)]
    bench.run(bench.questions(Since(ROBOT_STATE, 3)))
    assert [request.tick for request in bench.asked] == [3, 4, 5]
    (states,) = bench.got
    assert [state.tick for state in states] == [3, 4, 5, 6]
    assert all(isinstance(state, RobotState) for state in states)


def test_pages_that_bring_nothing_new_come_to_an_end(bench: Bench) -> None:
    bench.answers = [page(3, more=True), page(3, more=True)]
    bench.run(bench.questions(Since(ROBOT_STATE, 3)))
    assert [len(states) for states in bench.got] == [1]


def test_a_question_that_fails_is_asked_again(bench: Bench) -> None:
    bench.answers = [FrasError("not now"), LastReply(payload=b"")]
    bench.run(bench.questions(Last(HOLDS)))
    assert bench.got == [None]
    assert len(bench.asked) == 2


def test_what_can_not_be_read_is_thrown_in(bench: Bench) -> None:
    bench.answers = [LastReply(payload=b"garbage")]
    bench.run(bench.questions(Last(HOLDS)))
    assert isinstance(bench.got[0], MalformedMessage)


def test_an_error_of_its_own_leaves_a_service_that_knows_nothing(bench: Bench) -> None:
    def fails() -> Recalling:
        yield Last(HOLDS)
        raise FrasError("no mesh")

    bench.answers = [LastReply(payload=b"")]
    bench.run(fails())
    assert bench.taken == []
    assert bench.ready


def test_nothing_is_asked_before_there_is_a_recorder(bench: Bench) -> None:
    recall = Recall(bench.host, bench.questions(Last(HOLDS)), bench.taken.append)
    recall.wake(time.monotonic())
    assert bench.asked == []
    assert not bench.ready


def test_an_answer_that_comes_when_it_was_given_up_changes_nothing(bench: Bench) -> None:
    bench.answers = [LastReply(payload=encode(Holds(holds={})))]
    bench.client.announce("alive/recorder")
    while bench.host.drain(0.0):
        pass
    recall = Recall(bench.host, bench.questions(Last(HOLDS)), bench.taken.append)
    recall.wake(time.monotonic())
    recall.give_up()
    assert recall.is_done
    while bench.host.drain(0.0):
        pass
    assert len(bench.asked) == 1
    assert bench.got == bench.taken == []
