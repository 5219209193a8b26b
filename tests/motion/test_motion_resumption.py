"""A motion that was killed stands where it stood, moves nothing, and says so."""

import math
import time
from collections.abc import Iterator
from typing import Any

import pytest

from fras_common.bus import MemoryFabric, RemoteFault
from fras_common.messages import (
    ActionResult,
    CancelRequest,
    ExecuteReply,
    ExecuteRequest,
    HoldRequest,
    Holds,
    ResetRequest,
    ResumeRequest,
    RobotState,
)
from fras_common.scenario import MotionSection, RunSection, Scenario, resolve
from fras_common.topics import (
    ACTION_RESULT,
    CANCEL,
    EXECUTE,
    HOLD,
    HOLDS,
    MOTION_RESET,
    RESUME,
    ROBOT_STATE,
    TISSUE_STATE,
    VERDICT,
)
from fras_motion.service import MotionService
from support.remembering import Remembering
from support.shells import ShellBench
from support.tissues import tissue
from support.verdicts import verdict

TARGET = (0.03, 0.03, 0.005)
RESTART = {"restart": "motion started again at tick 20"}


class Theatre:
    """A fabric, what remembers, a client that judges, and motions that come and go."""

    def __init__(self, **motion: Any) -> None:
        self.fabric = MemoryFabric()
        self._lives = 0
        self.recorder = Remembering(self.fabric)
        self.bench = self.new()
        self.states: list[RobotState] = self.bench.heard(ROBOT_STATE)
        self.results: list[ActionResult] = self.bench.heard(ACTION_RESULT)
        self.holds: list[Holds] = self.bench.heard(HOLDS)
        self._verdicts = self.bench.client.publisher(VERDICT)
        run = RunSection(pace=0, require_log=False)
        self.scenario = resolve(Scenario(run=run, motion=MotionSection(**motion)))

    def new(self) -> ShellBench:
        self._lives += 1
        bench = ShellBench(
            "motion", MotionService, "sa/test", self.fabric, instance=f"life{self._lives}"
        )
        bench.host.announce_alive()
        bench.settle()
        return bench

    def restart(self) -> None:
        self.bench.kill()
        self.bench = self.new()

    def reset(self, trial: str = "t") -> None:
        self.recorder.say_status(trial, "resetting")
        request = ResetRequest(trial=trial, scenario=self.scenario)
        self.bench.answer(MOTION_RESET, request)

    def act(self, goal_id: str, name: str = "reach", target: Any = TARGET) -> ExecuteReply:
        action = f"{name}(psm1,b(2,2))"
        self.recorder.say_status("t", "acting", action=action, goal_id=goal_id)
        return self.ask(goal_id, name, target)

    def ask(self, goal_id: str, name: str = "reach", target: Any = TARGET) -> ExecuteReply:
        request = ExecuteRequest(
            trial="t", goal_id=goal_id, name=name, arm="psm1", block="b(2,2)", target_m=target
        )
        return self.bench.answer(EXECUTE, request)

    def judge(self, level: Any = "ok") -> None:
        self._verdicts.put(verdict(self.states[-1].tick, "t", level, grasped={"psm1": 4}))
        self.bench.settle()

    def finish(self, level: Any = "ok") -> ActionResult:
        count = len(self.results)
        while len(self.results) == count:
            self.judge(level)
        return self.results[-1]

    def resume(self, by: str = "executive") -> None:
        self.bench.answer(RESUME, ResumeRequest(holder="restart", by=by))
        self.bench.settle()


@pytest.fixture
def theatre() -> Iterator[Theatre]:
    made = Theatre()
    made.reset()
    yield made
    made.bench.close()


def moving(theatre: Theatre, ticks: int = 20) -> None:
    assert theatre.act("g1").accepted
    for _ in range(ticks):
        theatre.judge()
    assert theatre.states[-1].tick == ticks


def test_it_stands_where_it_stood_and_the_action_is_over(theatre: Theatre) -> None:
    moving(theatre)
    before = theatre.states[-1]
    assert before.action is not None
    assert before.action.phase == "traverse"
    theatre.restart()
    again = theatre.states[-1]
    assert theatre.bench.host.gate.trial == "t"
    assert (again.tick, again.verdict_tick) == (20, 19)
    assert again.holds == RESTART
    assert again.action is not None
    assert (again.action.goal_id, again.action.phase) == ("g1", "interrupted")
    for arm, state in before.arms.items():
        assert again.arms[arm].joints == state.joints
        assert again.arms[arm].setpoint_joints == state.setpoint_joints
        assert again.arms[arm].tip_in_world == state.tip_in_world
    assert [(one.goal_id, one.outcome, one.reason, one.tick) for one in theatre.results] == [
        ("g1", "interrupted", "restart", 20)
    ]
    theatre.judge()
    assert theatre.states[-1].tick == 20


def test_goal_of_before_the_restart_is_refused_after_it(theatre: Theatre) -> None:
    assert theatre.act("g1").accepted
    theatre.finish()
    assert theatre.act("g2", target=(0.03, 0.035, 0.005)).accepted
    theatre.judge()
    stood = theatre.states[-1].tick
    theatre.restart()
    theatre.resume()
    for goal in ("g1", "g2"):
        assert theatre.ask(goal).reason == "goal_used"
    theatre.judge()
    assert theatre.states[-1].tick == stood
    assert theatre.ask("g3").accepted


def test_no_goal_is_taken_before_the_restart_is_known(theatre: Theatre) -> None:
    moving(theatre)
    theatre.restart()
    assert theatre.ask("g2").reason == "restart"
    theatre.judge()
    assert theatre.states[-1].tick == 20
    with pytest.raises(RemoteFault, match="UnknownHold"):
        theatre.resume(by="somebody")
    theatre.resume()
    assert theatre.ask("g2").accepted
    assert theatre.finish().outcome == "succeeded"
    ticks = [state.tick for state in theatre.states]
    assert sorted(set(ticks)) == list(range(ticks[-1] + 1))


def test_what_is_asked_before_it_knows_the_trial_is_answered_when_it_does(theatre: Theatre) -> None:
    moving(theatre)
    theatre.recorder.silent = True
    theatre.restart()
    goal = ExecuteRequest(
        trial="t", goal_id="g2", name="reach", arm="psm1", block="b(2,2)", target_m=TARGET
    )
    executed = theatre.bench.ask(EXECUTE, goal)
    cancelled = theatre.bench.ask(CANCEL, CancelRequest(trial="t", reason="surgeon"))
    theatre.bench.settle()
    assert (executed, cancelled) == ([], [])
    theatre.recorder.speak()
    theatre.bench.settle()
    # Not as one who serves another trial: the executive would give this one up.
    assert [reply.reason for reply in executed] == ["restart"]
    assert [reply.tick for reply in cancelled] == [20]
    assert theatre.ask("g3").reason == "another_trial"
    assert theatre.states[-1].tick == 20


def test_the_way_on_starts_from_rest_where_it_stood(theatre: Theatre) -> None:
    moving(theatre)
    stood = theatre.states[-1].arms["psm1"]
    theatre.restart()
    theatre.resume()
    assert theatre.ask("g2").accepted
    theatre.judge()
    first = theatre.states[-1].arms["psm1"]
    steps = [abs(a - b) for a, b in zip(first.setpoint_joints, stood.setpoint_joints, strict=True)]
    assert 0.0 < max(steps) < 1e-3


def test_what_the_arms_remember_outlives_the_process(theatre: Theatre) -> None:
    """A jaw that closed pulls to a height above its grasp; a crossed hard limit stays crossed."""
    theatre.act("g1")
    theatre.finish()
    theatre.act("g2", "grasp", None)
    theatre.finish()
    height_m = theatre.states[-1].arms["psm1"].grasp_height_m
    assert height_m == pytest.approx(TARGET[2], abs=1e-6)
    theatre.restart()
    theatre.resume()
    theatre.act("g3", "pull", None)
    for _ in range(40):
        theatre.judge()
    assert theatre.finish("hard").reason == "force_hard"
    assert theatre.states[-1].arms["psm1"].hard_latched
    theatre.restart()
    theatre.resume()
    assert theatre.act("g4", "pull", None).reason == "hard_latch"
    assert theatre.act("g5", "release", None).accepted
    theatre.finish()
    assert not theatre.states[-1].arms["psm1"].hard_latched


def test_the_pull_after_a_restart_ends_where_it_would_have(theatre: Theatre) -> None:
    for goal, name, target in (("g1", "reach", TARGET), ("g2", "grasp", None)):
        theatre.act(goal, name, target)
        theatre.finish()
    theatre.act("g3", "pull", None)
    for _ in range(40):
        theatre.judge()
    theatre.restart()
    theatre.resume()
    theatre.act("g4", "pull", None)
    assert theatre.finish().outcome == "succeeded"
    tip = theatre.states[-1].arms["psm1"].tip_in_world.position_m
    assert tip[2] == pytest.approx(TARGET[2] + 0.05, abs=1e-4)


def test_a_goal_that_nobody_heard_of_any_more_is_over_too(theatre: Theatre) -> None:
    """Accepted, and killed before its first tick or the mirror of its question."""
    theatre.recorder.say_status("t", "acting", action="reach(psm1,b(2,2))", goal_id="g1")
    theatre.restart()
    (result,) = theatre.results
    assert (result.goal_id, result.name, result.arm, result.block) == (
        "g1",
        "reach",
        "psm1",
        "b(2,2)",
    )
    assert (result.outcome, result.reason) == ("interrupted", "restart")


def test_between_actions_the_last_result_is_said_again(theatre: Theatre) -> None:
    theatre.act("g1")
    theatre.finish()
    theatre.restart()
    assert [(one.goal_id, one.outcome) for one in theatre.results] == [("g1", "succeeded")] * 2


@pytest.mark.parametrize("lifted", [False, True])
def test_a_hold_that_was_acknowledged_before_anything_was_recalled_survives(
    theatre: Theatre, lifted: bool
) -> None:
    """Killed twice: the second motion takes the hold, and is killed before it has recalled."""
    theatre.bench.answer(HOLD, HoldRequest(holder="monitor", reason="before"))
    theatre.recorder.silent = True
    theatre.restart()
    state = theatre.bench.answer(HOLD, HoldRequest(holder="cli", reason="bleeding"))
    assert state.holds == {"cli": "bleeding"}
    if lifted:
        theatre.bench.answer(RESUME, ResumeRequest(holder="cli", by="cli"))
    theatre.bench.kill()
    theatre.recorder.forget_questions()
    theatre.bench = theatre.new()
    theatre.bench.settle()
    persons = {"monitor": "before"} if lifted else {"monitor": "before", "cli": "bleeding"}
    held = theatre.bench.answer(HOLD, HoldRequest(holder="probe", reason="asks")).holds
    assert {one: held[one] for one in held if one not in ("probe", "restart")} == persons


def test_holds_of_persons_stand_beside_the_restart(theatre: Theatre) -> None:
    moving(theatre)
    theatre.bench.answer(HOLD, HoldRequest(holder="cli", reason="look"))
    theatre.bench.settle()
    theatre.restart()
    assert theatre.states[-1].holds.keys() == {"cli", "restart"}
    theatre.resume()
    assert theatre.ask("g2").accepted
    tick = theatre.states[-1].tick
    theatre.judge()
    assert theatre.states[-1].tick == tick


@pytest.mark.parametrize("end", ["idle", "cancel", "reset"])
def test_the_restart_ends_with_the_trial(theatre: Theatre, end: str) -> None:
    moving(theatre)
    if end == "idle":
        theatre.recorder.say_status("t", "idle")
    theatre.restart()
    if end == "idle":
        assert theatre.bench.host.gate.trial == ""
    elif end == "cancel":
        theatre.bench.answer(CANCEL, CancelRequest(trial="t", reason="enough"))
    else:
        theatre.reset("t2")
    assert theatre.holds == [] or theatre.holds[-1].holds == {}


def test_a_cancelled_trial_is_not_taken_up(theatre: Theatre) -> None:
    moving(theatre)
    theatre.bench.ask(CANCEL, CancelRequest(trial="t", reason="enough"))
    for _ in range(5):
        theatre.judge()
    theatre.restart()
    assert theatre.bench.host.gate.trial == ""


@pytest.mark.parametrize("beyond", ["tissue", "verdict"])
def test_it_does_not_go_on_from_a_tick_that_others_have_passed(
    theatre: Theatre, beyond: str
) -> None:
    """The last robot state never reached the recorder, but what came of it did."""
    moving(theatre)
    if beyond == "tissue":
        theatre.recorder.bus.publisher(TISSUE_STATE).put(tissue(21))
    else:
        theatre.recorder.bus.publisher(VERDICT).put(verdict(21, "t", grasped={"psm1": 4}))
    theatre.restart()
    assert [(one.goal_id, one.outcome, one.reason) for one in theatre.results] == [
        ("g1", "aborted", "hold:motion")
    ]
    assert len(theatre.states) == 21
    assert theatre.ask("g2").reason == "another_trial"


def test_a_trial_that_is_not_remembered_ends(theatre: Theatre) -> None:
    theatre.recorder.say_status("t2", "acting", action="release(psm1)", goal_id="g3")
    theatre.restart()
    (result,) = theatre.results
    assert (result.trial, result.goal_id, result.name, result.block) == ("t2", "g3", "release", "")
    assert (result.outcome, result.reason) == ("aborted", "hold:motion")


def test_a_reset_that_is_asked_again_says_the_state_again(theatre: Theatre) -> None:
    theatre.reset()
    assert [state.tick for state in theatre.states] == [0, 0]
    theatre.act("g1")
    theatre.judge()
    theatre.reset()
    assert [state.tick for state in theatre.states] == [0, 0, 1, 0]
    assert theatre.results[-1].reason == "reset"


def test_a_goal_that_is_asked_again_is_answered_again_and_done_once(theatre: Theatre) -> None:
    assert theatre.act("g1").accepted
    assert theatre.ask("g1").accepted
    assert theatre.ask("g2").reason == "busy"
    theatre.finish()
    assert theatre.ask("g1").accepted
    tick = theatre.states[-1].tick
    theatre.judge()
    assert theatre.states[-1].tick == tick


@pytest.mark.parametrize("token", ["ready/sim", "ready/sa"])
def test_the_state_is_said_again_to_a_peer_that_comes_back(theatre: Theatre, token: str) -> None:
    theatre.bench.client.announce(token)
    theatre.bench.settle()
    assert [state.tick for state in theatre.states] == [0, 0]
    theatre.bench.client.announce("ready/planner")
    theatre.bench.settle()
    assert len(theatre.states) == 2


def test_a_state_that_nobody_answers_is_said_again(
    theatre: Theatre, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those who come back, and a router, may have lost it; in mid-action they are given time."""
    monkeypatch.setattr("fras_motion.tick_loop.SAY_AGAIN_S", math.inf)
    theatre.act("g1")
    theatre.bench.client.announce("ready/sim")
    theatre.bench.settle()
    assert len(theatre.states) == 1
    monkeypatch.setattr("fras_motion.tick_loop.SAY_AGAIN_S", 0.05)
    deadline_s = time.monotonic() + 10.0
    while len(theatre.states) < 3 and time.monotonic() < deadline_s:
        theatre.bench.service.wake()
        theatre.bench.host.drain(0.01)
    assert [state.tick for state in theatre.states] == [0, 0, 0]
    theatre.judge()
    assert theatre.states[-1].tick == 1
