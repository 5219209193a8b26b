"""A motion that starts again holds what the one before it held."""

from collections.abc import Iterator
from typing import Any

import pytest

from fras_common.bus import Call, MemoryBus, MemoryFabric, RemoteFault
from fras_common.codec import decode, encode
from fras_common.errors import FrasError
from fras_common.messages import (
    HoldRequest,
    Holds,
    HoldState,
    LastReply,
    LastRequest,
    OperatingState,
    ResumeRequest,
)
from fras_common.service import ServiceHost
from fras_common.topics import CRTK, HOLD, HOLDS, RECORDER_LAST, RESUME
from fras_motion.service import MotionService
from support.holding import holders
from support.shells import ShellBench

TURNS = 200


class Bench(ShellBench):
    """Motion, and a client that plays the recorder."""

    def __init__(self) -> None:
        super().__init__("motion", MotionService, client="recorder/test")
        self.asked: list[LastRequest] = []
        self.payload = b""
        self.fails = 0
        self.tokens: set[str] = set()
        self.client.serve(RECORDER_LAST, self._answer)
        self.client.watch_tokens(lambda token, present: self.tokens.add(token))
        self.host.announce_alive()

    def _answer(self, call: Call[LastRequest, LastReply]) -> None:
        self.asked.append(call.request)
        if self.fails:
            self.fails -= 1
            call.fail(FrasError("not now"))
        else:
            is_holds = call.request.key == HOLDS.key
            call.reply(LastReply(payload=self.payload if is_holds else b""))

    def recorder_appears(self) -> None:
        self.client.announce("alive/recorder")
        self.client.announce("alive/sim")
        self.client.announce("alive/sa")

    def turn_until_ready(self) -> None:
        for _ in range(TURNS):
            if self.ready:
                return
            wait_s = self.service.wake()
            self.host.drain(wait_s if wait_s is not None else 0.1)
        raise AssertionError("never ready")

    @property
    def ready(self) -> bool:
        return any(token.startswith("ready/motion") for token in self.tokens)

    def held(self) -> dict[str, str]:
        return holders(self)


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


def test_without_a_recorder_a_stop_works_but_motion_is_not_ready(bench: Bench) -> None:
    bench.settle()
    assert not bench.ready
    assert bench.asked == []
    state: HoldState = bench.answer(HOLD, HoldRequest(holder="surgeon", reason="bleeding"))
    assert state.holds == {"surgeon": "bleeding"}


def test_where_nothing_was_held_nothing_is(bench: Bench) -> None:
    bench.recorder_appears()
    bench.turn_until_ready()
    assert [one.key for one in bench.asked] == [
        *("motion/holds", "rpc/motion/hold", "rpc/motion/resume"),
        "planner/task_status",
    ]
    assert bench.held() == {}


def test_holds_of_before_stand_and_those_of_now_beside_them(bench: Bench) -> None:
    bench.payload = encode(Holds(holds={"surgeon": "bleeding", "cli": "old"}, seq=3))
    bench.answer(HOLD, HoldRequest(holder="cli", reason="new"))
    bench.recorder_appears()
    bench.turn_until_ready()
    assert bench.held() == {"surgeon": "bleeding", "cli": "new"}


@pytest.mark.parametrize(
    ("command", "state"), [("pause", "PAUSED"), ("disable", "DISABLED"), ("fault", "FAULT")]
)
def test_the_arms_states_come_back_too(bench: Bench, command: str, state: str) -> None:
    states: list[OperatingState] = bench.heard(CRTK[1].operating_state)
    bench.payload = encode(Holds(holds={"crtk/psm2": command}))
    bench.recorder_appears()
    bench.turn_until_ready()
    bench.settle()
    assert states[-1].state == state


def test_an_answer_that_can_not_be_read_holds_the_arms(bench: Bench) -> None:
    bench.payload = b"garbage"
    bench.recorder_appears()
    bench.turn_until_ready()
    (holder,) = bench.held()
    for by in ("executive", holder):
        with pytest.raises(RemoteFault):
            bench.answer(RESUME, ResumeRequest(holder=holder, by=by))
    state: HoldState = bench.answer(RESUME, ResumeRequest(holder=holder, by="monitor"))
    assert state.holds == {}


def test_it_asks_until_it_is_answered(bench: Bench) -> None:
    bench.fails = 2
    bench.payload = encode(Holds(holds={"surgeon": "bleeding"}))
    bench.recorder_appears()
    for _ in range(20):
        bench.settle()
    assert len(bench.asked) == 1  # a refusal is no reason to ask again at once
    bench.turn_until_ready()
    assert [one.key for one in bench.asked[:3]] == ["motion/holds"] * 3
    assert bench.held() == {"surgeon": "bleeding"}


def test_each_change_is_told_before_it_is_acknowledged(bench: Bench) -> None:
    bench.recorder_appears()
    bench.turn_until_ready()
    said: list[Holds] = bench.heard(HOLDS)
    said.clear()
    told_at_answer: list[int] = []

    def note(answer: Any) -> None:
        told_at_answer.append(len(said))

    bench.client.ask(HOLD, HoldRequest(holder="cli", reason="x"), note, 5.0)
    bench.client.ask(RESUME, ResumeRequest(holder="cli", by="cli"), note, 5.0)
    assert told_at_answer == [1, 2]
    assert [one.holds for one in said] == [{"cli": "x"}, {}]


@pytest.mark.parametrize("driver", ["simulated", "crtk"])
@pytest.mark.parametrize("holders", [(), ("software",)])
def test_what_is_held_early_does_not_make_the_recorder_forget(
    driver: str, holders: tuple[str, ...]
) -> None:
    """The recorder tells the last holds it heard, and those must not be the new motion's own."""
    fabric = MemoryFabric()
    client = MemoryBus(fabric, "cell", "recorder/test")
    last = encode(Holds(holds={"surgeon": "bleeding"}))

    def note(said: Holds) -> None:
        nonlocal last
        last = encode(said)

    client.subscribe(HOLDS, note)
    client.serve(
        RECORDER_LAST,
        lambda call: call.reply(LastReply(payload=last if call.request.key == HOLDS.key else b"")),
    )
    host = ServiceHost("motion")
    host.attach(MemoryBus(fabric, "cell", "motion/new"))
    service = MotionService(host, driver)
    for holder in holders:
        client.ask(HOLD, HoldRequest(holder=holder, reason="early"), lambda _: None, 5.0)
    client.announce("alive/recorder")
    service.wake()
    while host.drain(0.0):
        service.wake()
    held = decode(Holds, last, HOLDS.key).holds
    assert held["surgeon"] == "bleeding"
    assert set(holders) <= held.keys()
    client.close()
    host.bus.close()
