"""Motion holds while the log of a trial that demands one is not being written."""

from collections.abc import Iterator
from typing import Any

import pytest

from fras_common.bus import MemoryBus, MemoryFabric
from fras_common.messages import (
    CancelRequest,
    HoldRequest,
    LastReply,
    RecorderStatus,
    ResetRequest,
)
from fras_common.scenario import RunSection, Scenario, resolve
from fras_common.service import ServiceHost
from fras_common.topics import CANCEL, HOLD, MOTION_RESET, RECORDER_LAST, RECORDER_STATUS
from fras_motion.holds import Holds
from fras_motion.log_watch import LogWatch
from fras_motion.service import MotionService
from support.holding import holders
from support.shells import ShellBench


class Bench(ShellBench):
    """Motion, and a client that plays the recorder."""

    def __init__(self) -> None:
        super().__init__("motion", MotionService, client="recorder/test")
        self._statuses = self.client.publisher(RECORDER_STATUS)
        self.client.serve(RECORDER_LAST, lambda call: call.reply(LastReply(payload=b"")))
        self.client.announce("alive/recorder")
        self.settle()

    def begin(self, **run: Any) -> None:
        scenario = resolve(Scenario(run=RunSection(**run)))
        self.answer(MOTION_RESET, ResetRequest(trial="t", scenario=scenario))

    def say(self, state: Any, trial: str = "t", reason: str = "") -> dict[str, str]:
        """Say how the log is; returns who holds the arms then."""
        self._statuses.put(
            RecorderStatus(
                trial=trial, state=state, path="", messages=0, bytes=0, lost=0, reason=reason
            )
        )
        self.settle()
        return self.held()

    def held(self) -> dict[str, str]:
        return holders(self)


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


def test_a_log_that_falls_behind_holds_the_arms_until_it_has_caught_up(bench: Bench) -> None:
    bench.begin()
    assert bench.say("recording") == {}
    assert bench.say("behind", reason="2600 messages wait") == {
        "recorder": "the log is behind 2600 messages wait"
    }
    assert bench.say("recording") == {}


def test_a_log_that_can_not_be_written_holds_them(bench: Bench) -> None:
    bench.begin()
    bench.say("recording")
    assert bench.say("error", reason="disk full") == {"recorder": "the log is error disk full"}


def test_a_recorder_that_starts_anew_without_the_trial_holds_them(bench: Bench) -> None:
    bench.begin()
    bench.say("recording")
    assert "recorder" in bench.say("idle", trial="")


def test_the_log_of_before_is_no_matter_until_this_one_is_heard_of(bench: Bench) -> None:
    bench.say("closed", trial="yesterday")
    bench.begin()
    assert bench.held() == {}
    assert bench.say("closed", trial="yesterday") == {}
    assert bench.say("recording") == {}


def test_a_trial_that_needs_no_log_goes_on(bench: Bench) -> None:
    bench.begin(require_log=False)
    bench.say("recording")
    assert bench.say("error", reason="disk full") == {}


def test_after_the_trial_the_log_may_be_closed(bench: Bench) -> None:
    bench.begin()
    bench.say("recording")
    bench.ask(CANCEL, CancelRequest(trial="t", reason="over"))
    assert bench.say("closed") == {}


def test_it_lifts_its_own_hold_only(bench: Bench) -> None:
    bench.begin()
    bench.say("recording")
    bench.answer(HOLD, HoldRequest(holder="surgeon", reason="look"))
    bench.say("behind")
    assert bench.say("recording") == {"surgeon": "look"}


def test_a_recorder_that_comes_back_is_given_a_moment_to_recover() -> None:
    """What is said right after a router came back may push out what is being recovered."""
    now_s = 0.0
    fabric = MemoryFabric()
    recorder = MemoryBus(fabric, "cell", "recorder/test")
    host = ServiceHost("motion")
    host.attach(MemoryBus(fabric, "cell", "motion/test"))
    holds = Holds()
    watch = LogWatch(host, holds, lambda: now_s)
    watch.begin("t", required=True)
    recorder.announce("alive/recorder")
    status = RecorderStatus(
        trial="t", state="recording", path="", messages=0, bytes=0, lost=0, reason=""
    )
    recorder.publisher(RECORDER_STATUS).put(status)

    def held() -> dict[str, str]:
        while host.drain(0.0):
            pass
        watch.wake()
        return holds.current()

    assert held() == {}
    recorder.close()
    assert held() == {"recorder": "the recorder is away"}
    now_s = 5.0
    assert "recorder" in held()
    again = MemoryBus(fabric, "cell", "recorder/test")
    again.announce("alive/recorder")
    now_s = 5.9
    assert "recorder" in held()
    now_s = 6.1
    assert held() == {}
    again.close()
    host.bus.close()


def test_a_log_that_was_opened_before_motion_was_reset_is_watched() -> None:
    fabric = MemoryFabric()
    recorder = MemoryBus(fabric, "cell", "recorder/test")
    host = ServiceHost("motion")
    host.attach(MemoryBus(fabric, "cell", "motion/test"))
    holds = Holds()
    watch = LogWatch(host, holds)
    recorder.announce("alive/recorder")
    recorder.publisher(RECORDER_STATUS).put(
        RecorderStatus(
            trial="t", state="recording", path="", messages=0, bytes=0, lost=0, reason=""
        )
    )
    while host.drain(0.0):
        pass
    watch.begin("t", required=True)
    recorder.close()
    while host.drain(0.0):
        pass
    watch.wake()
    assert holds.current() == {"recorder": "the recorder is away"}
    host.bus.close()
