"""Motion's shell on an in-memory bus: interlock, patience, holds, refusals."""

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
from structlog.testing import capture_logs

from fras_common.bus import RemoteFault
from fras_common.codec import decode
from fras_common.messages import (
    ActionResult,
    CancelReply,
    CancelRequest,
    ExecuteReply,
    ExecuteRequest,
    FaultRecord,
    Health,
    HoldRequest,
    HoldState,
    ResetRequest,
    ResumeRequest,
    RobotState,
    RpcRecord,
    StateCommand,
)
from fras_common.scenario import RunSection, Scenario, resolve
from fras_common.service.health import ProcessMeter
from fras_common.service.rates import TOLD_AT_ONCE
from fras_common.topics import (
    ACTION_RESULT,
    CANCEL,
    CRTK,
    EXECUTE,
    FAULT,
    HOLD,
    MOTION_RESET,
    RESUME,
    ROBOT_STATE,
    RPC,
    VERDICT,
)
from fras_motion.safety import GATES
from fras_motion.service import MotionService
from support.remembering import Remembering
from support.shells import ShellBench
from support.verdicts import verdict

TARGET = (0.03, 0.03, 0.005)


class Bench(ShellBench):
    """Motion, and a client that plays SA."""

    def __init__(self) -> None:
        super().__init__("motion", MotionService, client="sa/test")
        self.states: list[RobotState] = self.heard(ROBOT_STATE)
        self.results: list[ActionResult] = self.heard(ACTION_RESULT)
        self._verdicts = self.client.publisher(VERDICT)

    def reset(self, trial: str = "t", **run: Any) -> None:
        scenario = resolve(Scenario(run=RunSection(pace=0, **run)))
        self.answer(MOTION_RESET, ResetRequest(trial=trial, scenario=scenario))

    def reach(self, goal_id: str = "g1", trial: str = "t", **changes: Any) -> ExecuteReply:
        fields: dict[str, Any] = {"name": "reach", "arm": "psm1", "target_m": TARGET, **changes}
        request = ExecuteRequest(trial=trial, goal_id=goal_id, block="b(2,2)", **fields)
        return self.answer(EXECUTE, request)

    def judge(self, tick: int, trial: str = "t", level: Any = "ok") -> None:
        self._verdicts.put(verdict(tick, trial, level))
        self.settle()

    def judge_until_result(self) -> ActionResult:
        while not self.results:
            self.judge(self.states[-1].tick)
        return self.results[-1]


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


def test_no_tick_without_the_verdict_on_the_present_one(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fras_motion.tick_loop.SAY_AGAIN_S", math.inf)
    bench.reset()
    assert [state.tick for state in bench.states] == [0]
    assert bench.reach().accepted
    assert [state.tick for state in bench.states] == [0]
    bench.judge(0)
    assert [state.tick for state in bench.states] == [0, 1]
    bench.settle()
    bench.judge(0)
    bench.judge(7)
    assert [state.tick for state in bench.states] == [0, 1]
    bench.judge(1)
    assert [state.tick for state in bench.states] == [0, 1, 2]
    assert [state.verdict_tick for state in bench.states] == [-1, 0, 1]


def test_the_verdict_of_before_said_again_is_no_fault(bench: Bench) -> None:
    """SA answers a state that is said again, as with each new hold, with the same verdict."""
    faults: list[FaultRecord] = bench.heard(FAULT.of(service="motion"))
    bench.reset()
    bench.reach()
    bench.judge(0)
    bench.judge(0)
    bench.judge(1)
    assert [state.tick for state in bench.states] == [0, 1, 2]
    assert faults == []
    bench.judge(0)
    assert [fault.kind for fault in faults] == ["StaleVerdict"]
    bench.judge(2)
    assert bench.states[-1].tick == 3


def test_verdict_for_another_trial_moves_nothing_and_is_counted(bench: Bench) -> None:
    bench.reset()
    bench.reach()
    bench.judge(0, trial="yesterday")
    assert len(bench.states) == 1
    bench.reset("t2")
    assert bench.host.gate.dropped == 1


def test_whole_reach_succeeds_and_time_then_stands_still(bench: Bench) -> None:
    bench.reset()
    bench.reach()
    result = bench.judge_until_result()
    assert (result.outcome, result.goal_id) == ("succeeded", "g1")
    assert result.tick == bench.states[-1].tick
    bench.judge(result.tick)
    assert bench.states[-1].tick == result.tick


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"trial": "yesterday"}, "another_trial"),
        ({"name": "fly"}, "unknown_action"),
        ({"arm": "psm3"}, "unknown_arm"),
        ({"target_m": None}, "target_missing"),
        ({"target_m": (0.5, 0.03, 0.005)}, "workspace"),
    ],
)
def test_bad_goal_is_refused_by_name(bench: Bench, changes: dict[str, Any], reason: str) -> None:
    bench.reset()
    reply = bench.reach(**changes)
    assert not reply.accepted
    assert reply.reason == reason
    bench.judge(0)
    assert len(bench.states) == 1


def test_goal_before_any_reset_is_refused(bench: Bench) -> None:
    remembers_nothing = Remembering(bench.fabric)
    bench.settle()
    assert bench.reach().reason == "another_trial"
    remembers_nothing.close()


def test_goal_of_before_a_reset_is_refused_once_one_has_come(bench: Bench) -> None:
    goal = ExecuteRequest(
        trial="yesterday", goal_id="g1", name="reach", arm="psm1", block="", target_m=TARGET
    )
    early = bench.ask(EXECUTE, goal)
    # A new process does not know yet which trial is under way, and nobody tells it.
    assert early == []
    bench.reset()
    bench.settle()
    assert [reply.reason for reply in early] == ["another_trial"]


def test_goal_that_was_taken_before_is_refused_and_moves_nothing(bench: Bench) -> None:
    bench.reset()
    assert bench.reach("g1").accepted
    first = bench.judge_until_result()
    # Word for word: who has not heard the answer asks once more, and nothing moves.
    assert bench.reach("g1").accepted
    bench.judge(first.tick)
    assert bench.reach("g1", target_m=(0.03, 0.035, 0.005)).reason == "goal_used"
    assert bench.reach("g2", target_m=(0.03, 0.035, 0.005)).accepted
    # In mid-action, too, and by its own name rather than that of what runs.
    assert bench.reach("g1").reason == "goal_used"
    bench.results.clear()
    second = bench.judge_until_result()
    assert second.goal_id == "g2"
    for _ in range(2):
        assert bench.reach("g1").reason == "goal_used"
        bench.judge(second.tick)
    assert bench.states[-1].tick == second.tick
    assert [one.goal_id for one in bench.results] == ["g2"]
    assert health(bench).refusals == {"goal_used": 4}


def test_goal_that_was_refused_may_be_asked_again(bench: Bench) -> None:
    bench.reset()
    assert bench.reach("g1", target_m=(0.5, 0.03, 0.005)).reason == "workspace"
    assert bench.reach("g1").accepted
    bench.reset("t2")
    assert bench.reach("g1", trial="t2").accepted


def test_hold_is_answered_before_the_loop_gets_to_it(bench: Bench) -> None:
    bench.reset()
    bench.reach()
    for tick in range(40):
        bench.judge(tick)
    answers: list[HoldState] = []
    request = HoldRequest(holder="monitor", reason="stop pressed")
    bench.client.ask(HOLD, request, answers.append, 5.0)  # type: ignore[arg-type]
    assert answers[0].holds == {"monitor": "stop pressed"}  # the loop has not run since
    for tick in range(40, 46):
        bench.judge(tick)
    stopped = bench.states[-1]
    assert stopped.tick <= 43
    assert stopped.holds == {"monitor": "stop pressed"}
    assert stopped.action is not None
    with pytest.raises(RemoteFault, match="NotYourHold"):
        bench.answer(RESUME, ResumeRequest(holder="monitor", by="executive"))
    with pytest.raises(RemoteFault, match="UnknownHold"):
        bench.answer(RESUME, ResumeRequest(holder="cli", by="cli"))
    assert bench.answer(RESUME, ResumeRequest(holder="monitor", by="cli")).holds == {}
    bench.judge(stopped.tick)
    assert (bench.results[-1].outcome, bench.results[-1].reason) == ("interrupted", "hold")


def test_hold_outlives_a_reset(bench: Bench) -> None:
    bench.reset()
    bench.answer(HOLD, HoldRequest(holder="cli", reason="wait"))
    bench.reset("t2")
    assert bench.reach(trial="t2").accepted
    bench.judge(0, trial="t2")
    assert bench.states[-1].tick == 0
    assert bench.states[-1].holds == {"cli": "wait"}


@pytest.mark.parametrize(
    ("run", "held", "reason"),
    [
        ({"peer_timeout_s": 0.05}, False, "hold:sim"),
        ({"hold_timeout_s": 0.05}, True, "hold:cli:look"),
    ],
)
def test_patience_ends_and_says_who_was_waited_for(
    bench: Bench, run: dict[str, Any], held: bool, reason: str
) -> None:
    bench.reset(**run)
    bench.judge(0)
    if held:
        bench.answer(HOLD, HoldRequest(holder="cli", reason="look"))
    bench.reach()
    deadline_s = time.monotonic() + 10
    while not bench.results and time.monotonic() < deadline_s:
        bench.settle()
    assert (bench.results[-1].outcome, bench.results[-1].reason) == ("aborted", reason)
    assert health(bench).refusals["hold_timeout" if held else "watchdog"] == 1


def test_reset_with_impossible_numbers_is_a_typed_fault(bench: Bench) -> None:
    from fras_common.scenario import MotionSection

    scenario = resolve(Scenario(motion=MotionSection(free_speed_m_s=0.4)))
    with pytest.raises(RemoteFault, match="free_speed_m_s"):
        bench.answer(MOTION_RESET, ResetRequest(trial="t", scenario=scenario))


def cancel(bench: Bench, trial: str = "t") -> list[CancelReply]:
    return bench.ask(CANCEL, CancelRequest(trial=trial, reason="test"))


def test_cancel_brings_the_arms_to_rest_before_it_is_answered(bench: Bench) -> None:
    bench.reset()
    bench.reach()
    for tick in range(40):
        bench.judge(tick)
    answers = cancel(bench)
    assert answers == []
    for tick in range(40, 46):
        bench.judge(tick)
    assert answers[0].tick == bench.states[-1].tick <= 43
    assert (bench.results[-1].outcome, bench.results[-1].reason) == ("aborted", "cancelled")
    assert bench.states[-1].holds == {"cancel": "test"}


def test_goal_that_comes_after_the_cancel_moves_nothing(bench: Bench) -> None:
    bench.reset()
    bench.judge(0)
    assert cancel(bench)[0].tick == 0
    late = bench.reach()
    assert (late.accepted, late.reason) == (False, "another_trial")
    bench.judge(0)
    assert len(bench.states) == 1
    bench.reset("t2")
    assert bench.reach(trial="t2").accepted


def test_cancel_of_another_trial_is_answered_and_stops_nothing(bench: Bench) -> None:
    bench.reset()
    bench.reach()
    bench.judge(0)
    cancel(bench, "yesterday")
    bench.judge(1)
    assert [state.tick for state in bench.states] == [0, 1, 2]
    assert bench.results == []


def test_cancel_does_not_wait_for_a_verdict_that_never_comes(bench: Bench) -> None:
    bench.reset(peer_timeout_s=60.0)
    bench.judge(0)
    bench.reach()
    assert bench.states[-1].tick == 1  # and no verdict on it
    answers = cancel(bench)
    deadline_s = time.monotonic() + 10
    while not answers and time.monotonic() < deadline_s:
        bench.settle()
    assert answers[0].tick == 1
    assert bench.results[-1].reason == "cancelled"


def test_reset_in_mid_action_ends_that_action_by_name(bench: Bench) -> None:
    bench.reset()
    bench.judge(0)
    bench.reach()
    bench.reset("t2")
    assert (bench.results[-1].trial, bench.results[-1].reason) == ("t", "reset")


def test_hold_that_no_tick_can_show_is_published_all_the_same(bench: Bench) -> None:
    bench.reset()
    bench.answer(HOLD, HoldRequest(holder="cli", reason="wait"))
    assert [(state.tick, state.holds) for state in bench.states] == [
        (0, {}),
        (0, {"cli": "wait"}),
    ]
    assert bench.host.facts["holds"] == "cli: wait"
    bench.answer(RESUME, ResumeRequest(holder="cli", by="cli"))
    assert bench.states[-1].holds == {}


def health(bench: Bench) -> Health:
    return bench.host.health(ProcessMeter())


def test_refused_goal_is_on_the_bus_with_its_numbers_and_counted(bench: Bench) -> None:
    bench.reset()
    mirrors: list[RpcRecord] = bench.heard(RPC.of(service="motion", name="execute"))
    reply = bench.reach(target_m=(0.5, 0.03, 0.005))
    assert reply.reason == "workspace"
    assert (reply.values["value"], reply.values["upper"]) == ("0.5", "0.11")
    assert "x of the tip [m] would be 0.5" in reply.text
    bench.settle()
    assert decode(ExecuteReply, bytes(mirrors[-1].reply), "") == reply
    bench.reach(target_m=(0.5, 0.03, 0.005))
    bench.reach(trial="yesterday")
    assert health(bench).refusals == {"another_trial": 1, "workspace": 2}


def test_goals_that_are_refused_again_and_again_do_not_fill_the_log(bench: Bench) -> None:
    bench.reset()
    bench.host.clock = lambda: 0.0
    with capture_logs() as logs:
        for _ in range(TOLD_AT_ONCE + 20):
            bench.reach(trial="yesterday")
            bench.settle()
    assert health(bench).refusals == {"another_trial": TOLD_AT_ONCE + 20}
    assert [log["event"] for log in logs] == ["goal refused"] * TOLD_AT_ONCE


@pytest.mark.parametrize("other", [0, 3, 7])
def test_verdict_on_another_tick_is_refused_by_name_on_the_bus(bench: Bench, other: int) -> None:
    faults: list[FaultRecord] = bench.heard(FAULT.of(service="motion"))
    bench.reset()
    bench.reach()
    bench.judge(0)
    bench.judge(1)
    before = bench.states[-1]
    bench.judge(other)
    assert bench.states[-1] == before
    assert (faults[-1].key, faults[-1].kind, faults[-1].tick) == (
        VERDICT.key,
        "StaleVerdict",
        other,
    )
    assert faults[-1].values == {"expected": "2", "got": str(other)}
    assert health(bench).refusals == {"verdict_tick": 1}
    bench.judge(2)
    assert bench.states[-1].tick == 3


def test_verdict_of_another_trial_is_refused_by_name_on_the_bus(bench: Bench) -> None:
    faults: list[FaultRecord] = bench.heard(FAULT.of(service="motion"))
    bench.reset()
    bench.reach()
    bench.judge(0, trial="yesterday")
    assert len(bench.states) == 1
    assert faults == []  # that trial might have been about to begin
    bench.reset("t2")
    assert (faults[-1].kind, faults[-1].trial) == ("AnotherTrial", "yesterday")
    assert faults[-1].values == {"trial": "yesterday", "serves": "t2"}
    assert health(bench).refusals == {"another_trial": 1}


def test_gate_that_ends_an_action_puts_its_numbers_on_the_bus(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench.reset()
    bench.reach()
    for tick in range(20):
        bench.judge(tick)
    # The path was accepted under wider bounds than those in force now.
    gate = GATES["cartesian_speed"]
    monkeypatch.setitem(
        GATES, "cartesian_speed", lambda step, bounds: gate(step, replace(bounds, speed_m_s=0.001))
    )
    bench.judge(20)
    result = bench.results[-1]
    assert (result.outcome, result.reason) == ("aborted", "gate:cartesian_speed")
    assert (result.values["gate"], result.values["upper"]) == ("cartesian_speed", "0.001")
    assert float(result.values["value"]) > 0.001
    assert "speed of the tip [m/s] would be" in result.text
    assert health(bench).refusals == {"cartesian_speed": 1}


def test_what_stops_an_action_is_counted_by_name(bench: Bench) -> None:
    bench.reset()
    bench.reach()
    for tick in range(20):
        bench.judge(tick)
    bench.judge(20, level="hard")
    bench.judge_until_result()
    assert bench.reach("g2").reason == "hard_latch"
    bench.reset("t2")
    bench.reach(trial="t2")
    bench.judge(0, trial="t2")
    bench.answer(HOLD, HoldRequest(holder="cli", reason="wait"))
    cancel(bench, "t2")
    assert health(bench).refusals == {"cancel": 1, "force_hard": 1, "hard_latch": 1, "hold": 1}


@pytest.mark.parametrize("held", [False, True])
def test_cancel_for_another_trial_is_answered_and_ends_nothing(bench: Bench, held: bool) -> None:
    bench.reset()
    bench.reach()
    bench.judge(0)
    if held:
        bench.answer(HOLD, HoldRequest(holder="surgeon", reason="x"))
        for _ in range(3):
            bench.judge(bench.states[-1].tick)
    reply: CancelReply = bench.answer(CANCEL, CancelRequest(trial="yesterday", reason="forged"))
    assert reply.tick == bench.states[-1].tick
    assert bench.results == []
    if held:
        bench.answer(RESUME, ResumeRequest(holder="surgeon", by="surgeon"))
    expected = "interrupted" if held else "succeeded"
    assert bench.judge_until_result().outcome == expected


def test_holder_named_as_motions_own_hold_is_one_of_many(bench: Bench) -> None:
    bench.reset()
    bench.reach()
    bench.judge(0)
    bench.answer(HOLD, HoldRequest(holder="cancel", reason="x"))
    said = len(bench.states)
    for _ in range(5):
        bench.settle()
    assert len(bench.states) == said
    bench.answer(RESUME, ResumeRequest(holder="cancel", by="cancel"))
    assert bench.judge_until_result().outcome == "interrupted"
    assert bench.states[-1].holds == {}
    assert bench.host.refusals["hold"] == 1


@pytest.mark.parametrize("holder", ["restart", "crtk/psm1", "arms/psm2"])
def test_software_lifts_no_hold_of_a_client_that_took_its_name(bench: Bench, holder: str) -> None:
    states = bench.client.publisher(CRTK[0].state_command)
    bench.answer(HOLD, HoldRequest(holder=holder, reason="surgeon"))
    for command in ("home", "pause", "resume"):
        states.put(StateCommand(command=command))  # type: ignore[arg-type]
    bench.settle()
    with pytest.raises(RemoteFault):
        bench.answer(RESUME, ResumeRequest(holder=holder, by="executive"))
    state: HoldState = bench.answer(HOLD, HoldRequest(holder="probe", reason=""))
    assert state.holds == {f"client:{holder}": "surgeon", "probe": ""}
    bench.answer(RESUME, ResumeRequest(holder="probe", by="probe"))
    state = bench.answer(RESUME, ResumeRequest(holder=holder, by="monitor"))
    assert state.holds == {}


def test_client_does_not_lift_the_hold_of_an_arms_own_state(bench: Bench) -> None:
    states = bench.client.publisher(CRTK[0].state_command)
    states.put(StateCommand(command="disable"))
    bench.settle()
    with pytest.raises(RemoteFault, match="holds nothing"):
        bench.answer(RESUME, ResumeRequest(holder="crtk/psm1", by="crtk/psm1"))
    state: HoldState = bench.answer(RESUME, ResumeRequest(holder="crtk/psm1", by="cli"))
    assert state.holds == {}


def test_hold_lifted_before_the_loop_looked_stops_the_action(bench: Bench) -> None:
    bench.reset()
    bench.reach()
    bench.judge(0)
    answers: list[Any] = []
    bench.client.ask(HOLD, HoldRequest(holder="surgeon", reason="x"), answers.append, 5.0)
    bench.client.ask(RESUME, ResumeRequest(holder="surgeon", by="cli"), answers.append, 5.0)
    assert [one.holds for one in answers] == [{"surgeon": "x"}, {}]
    bench.settle()
    result = bench.judge_until_result()
    assert (result.outcome, result.reason) == ("interrupted", "hold")
    assert result.tick <= 4
    assert bench.host.refusals["hold"] == 1
    bench.reset("t2")
    assert bench.host.refusals["hold"] == 1
