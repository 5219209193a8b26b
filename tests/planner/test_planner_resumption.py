"""The planner's shell: it takes a trial up by itself, and asks again who was away."""

import time
from collections.abc import Iterator
from typing import Any

import msgspec
import pytest

from fras_common.bus import Call, MemoryBus, MemoryFabric
from fras_common.codec import content_digest
from fras_common.errors import FrasError
from fras_common.messages import (
    ActionResult,
    ActionState,
    ContextRequest,
    ExecuteReply,
    ExecuteRequest,
    OpenRequest,
    ResetReply,
    ResetRequest,
    TaskReply,
    TaskRequest,
    TaskStatus,
)
from fras_common.scenario import GeneratorSection, RunSection, Scenario, resolve
from fras_common.topics import (
    ACTION_RESULT,
    CANCEL,
    EXECUTE,
    MOTION_RESET,
    RECORDER_OPEN,
    ROBOT_STATE,
    SA_CONTEXT,
    SIM_RESET,
    TASK,
    TASK_STATUS,
)
from fras_planner.service import PlannerService
from support.remembering import Remembering
from support.robots import robot
from support.shells import ShellBench

SCENARIO = resolve(Scenario(run=RunSection(peer_timeout_s=5.0)))
REACH = "reach(psm1,b(1,1))"


class Theatre:
    """A fabric, what remembers, a client that plays the peers, and planners that come and go."""

    def __init__(self) -> None:
        self.fabric = MemoryFabric()
        self.recorder = Remembering(self.fabric)
        self.bench: Any = None
        self.asked: list[Any] = []

    def start(self) -> None:
        self.bench = ShellBench("planner", PlannerService, "cli/test", self.fabric)
        self.statuses: list[TaskStatus] = self.bench.heard(TASK_STATUS)
        self.statuses.clear()
        self.bench.host.announce_alive()
        self.bench.client.announce("ready/motion")
        self.bench.settle()

    def note(self, query: Any) -> None:
        self.bench.client.serve(query, lambda call: self.asked.append(call.request))

    def until(self, condition: Any) -> None:
        deadline_s = time.monotonic() + 20
        while not condition() and time.monotonic() < deadline_s:
            self.bench.host.drain(0.02)
            self.bench.service.wake()
        assert condition()


@pytest.fixture
def theatre() -> Iterator[Theatre]:
    made = Theatre()
    yield made
    made.bench.close()


def acting(theatre: Theatre) -> None:
    """Leave a trial whose executive was killed in its first action."""
    request = TaskRequest(command="start", trial="t", scenario=SCENARIO)
    theatre.recorder.say_asked(TASK, request, TaskReply(accepted=True, reason=""), "t")
    theatre.recorder.say_status(
        "t", "acting", action=REACH, goal_id="g1", goals=1, contexts=1, plans=1, plan="c1"
    )


def result(goal_id: str = "g1") -> ActionResult:
    return ActionResult(
        tick=40,
        trial="t",
        goal_id=goal_id,
        name="reach",
        arm="psm1",
        block="b(1,1)",
        outcome="succeeded",
        reason="",
    )


def executed(theatre: Theatre, *, accepted: bool) -> None:
    request = ExecuteRequest(
        trial="t", goal_id="g1", name="reach", arm="psm1", block="b(1,1)", target_m=(0.0, 0.0, 0.0)
    )
    theatre.recorder.say_asked(EXECUTE, request, ExecuteReply(accepted=accepted, reason=""), "t")


def test_it_waits_for_the_action_under_way_and_then_asks_what_is_true(theatre: Theatre) -> None:
    acting(theatre)
    executed(theatre, accepted=True)
    theatre.start()
    theatre.note(SA_CONTEXT)
    assert theatre.bench.host.gate.trial == "t"
    assert [status.phase for status in theatre.statuses] == ["acting"]
    theatre.bench.peers(ACTION_RESULT).put(result())
    theatre.until(lambda: theatre.asked)
    assert theatre.asked == [ContextRequest(trial="t", request_id="c2", min_tick=40, expected=[])]
    assert theatre.statuses[-1].actions == [REACH]


@pytest.mark.parametrize("known_by", ["result", "robot"])
def test_an_action_that_has_ended_meanwhile_or_moves_was_begun(
    theatre: Theatre, known_by: str
) -> None:
    acting(theatre)
    bus = theatre.recorder.bus
    if known_by == "result":
        bus.publisher(ACTION_RESULT).put(result())
    else:
        state = ActionState(goal_id="g1", name="reach", arm="psm1", block="b(1,1)", phase="rise")
        bus.publisher(ROBOT_STATE).put(robot(3, action=state))
    theatre.start()
    theatre.note(SA_CONTEXT)
    if known_by == "robot":
        assert theatre.asked == []
        theatre.bench.peers(ACTION_RESULT).put(result())
    theatre.until(lambda: theatre.asked)
    assert theatre.asked[0].min_tick == 40


def test_an_action_that_ends_while_the_trial_is_recalled_has_ended(theatre: Theatre) -> None:
    """Between the answer that there is no result yet and the moment in which one is waited for."""
    acting(theatre)
    executed(theatre, accepted=True)
    motion = MemoryBus(theatre.fabric, "cell", "motion/test").publisher(ACTION_RESULT)
    theatre.recorder.then[ACTION_RESULT.key] = lambda: motion.put(result())
    theatre.start()
    theatre.note(SA_CONTEXT)
    theatre.until(lambda: theatre.asked)
    assert theatre.asked[0].min_tick == 40
    assert theatre.statuses[-1].actions == [REACH]


@pytest.mark.parametrize("asked", [True, False])
def test_an_action_that_was_never_begun_is_not_waited_for(theatre: Theatre, asked: bool) -> None:
    acting(theatre)
    if asked:
        executed(theatre, accepted=False)
    theatre.start()
    theatre.note(SA_CONTEXT)
    theatre.until(lambda: theatre.asked)
    assert theatre.asked[0].min_tick == 0
    assert theatre.statuses[-1].actions == []


@pytest.mark.parametrize("phase", ["idle", None])
def test_where_no_trial_runs_none_is_taken_up(theatre: Theatre, phase: Any) -> None:
    if phase is not None:
        theatre.recorder.say_status("t", phase)
    theatre.start()
    assert theatre.statuses == []


def test_a_trial_whose_start_is_forgotten_is_ended_by_name(theatre: Theatre) -> None:
    theatre.recorder.say_status("t", "resetting")
    theatre.start()
    theatre.note(CANCEL)
    theatre.until(lambda: theatre.asked)
    assert theatre.asked[0].trial == "t"


def test_a_service_that_was_away_is_asked_again(theatre: Theatre) -> None:
    theatre.start()
    client = theatre.bench.client

    def open_log(call: Call[OpenRequest, ResetReply]) -> None:
        request = call.request
        digest = content_digest(request.trial, request.scenario, request.mesh)
        call.reply(ResetReply(digest=digest))

    def reset(call: Call[ResetRequest, ResetReply]) -> None:
        request = call.request
        digest = content_digest(request.trial, request.scenario, request.mesh)
        call.reply(ResetReply(digest=digest))

    client.serve(RECORDER_OPEN, open_log)
    theatre.note(SIM_RESET)
    theatre.bench.ask(TASK, TaskRequest(command="start", trial="t", scenario=SCENARIO))
    theatre.until(lambda: theatre.bench.host.state == "waiting: motion")
    assert theatre.asked == []
    client.serve(MOTION_RESET, reset)
    theatre.until(lambda: theatre.asked)
    assert theatre.bench.host.waiting_for == ""
    assert theatre.statuses[-1].phase == "resetting"


def test_a_start_that_is_refused_leaves_what_is_taken_up_as_it_is(theatre: Theatre) -> None:
    acting(theatre)
    theatre.recorder.silent = True
    theatre.start()
    wrong = msgspec.structs.replace(
        SCENARIO, generator=GeneratorSection(disc_radius_min_m=0.04, disc_radius_max_m=0.02)
    )
    (refusal,) = theatre.bench.ask(TASK, TaskRequest(command="start", trial="u", scenario=wrong))
    assert isinstance(refusal, FrasError)
    theatre.recorder.speak()
    theatre.until(lambda: theatre.bench.host.gate.trial == "t")
    assert theatre.statuses[-1].phase == "acting"
