"""Effects that wait: for time, or for the end of an action."""

from collections.abc import Generator
from typing import Any, cast

from fras_common.errors import FrasError
from fras_common.messages import ActionResult
from fras_planner.effects import AwaitResult, Effect, Pause
from fras_planner.performer import Performer


class Clock:
    now_s = 10.0

    def __call__(self) -> float:
        return self.now_s


def performer(clock: Clock, ends: list[FrasError | None]) -> Performer:
    nobody = cast(Any, None)  # nothing is asked or said here
    return Performer(nobody, nobody, nobody, lambda: None, ends.append, clock)


def test_a_pause_ends_by_the_clock_and_tells_for_whom_it_is():
    clock, ends, passed = Clock(), list[FrasError | None](), list[str]()

    def steps() -> Generator[Effect, Any, None]:
        yield Pause(2.0, "recorder")
        passed.append("one")
        yield Pause(1.0, "recorder")

    waiting = performer(clock, ends)
    waiting.start(steps())
    assert (waiting.missing, waiting.wake()) == ("recorder", 2.0)
    clock.now_s += 1.5
    assert waiting.wake() == 0.5
    assert passed == []
    clock.now_s += 0.5
    waiting.wake()
    assert passed == ["one"]
    assert waiting.wake() == 1.0
    clock.now_s += 5.0
    waiting.wake()
    assert ends == [None]
    assert (waiting.missing, waiting.wake()) == ("", None)


def ended(goal_id: str, tick: int) -> ActionResult:
    return ActionResult(
        tick=tick, trial="t", goal_id=goal_id, name="reach", arm="psm1", block="b(1,1)",
        outcome="succeeded", reason="",
    )  # fmt: skip


def test_an_end_that_came_before_the_beginning_is_known_and_that_of_another_trial_is_not():
    taken = list[int]()

    def steps() -> Generator[Effect, Any, None]:
        result: ActionResult = yield AwaitResult("g1")
        taken.append(result.tick)

    waiting = performer(Clock(), [])
    waiting.deliver(ended("g1", 7))
    waiting.forget_results()
    waiting.start(steps())
    assert waiting.awaited == "g1"
    assert taken == []
    waiting.forget_results()
    waiting.deliver(ended("g1", 8))
    waiting.start(steps())
    assert taken == [8]
    waiting.forget_results()
    waiting.start(steps(), result=ended("g1", 9))
    assert taken == [8, 9]
