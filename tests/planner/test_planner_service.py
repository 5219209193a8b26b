"""The planner's shell on an in-memory bus: one trial at a time, every start answered once."""

import time
from collections.abc import Iterator
from typing import Any

import msgspec
import pytest

from fras_common.codec import content_digest
from fras_common.digests import rules_digest
from fras_common.errors import FrasError
from fras_common.messages import (
    ActionResult,
    OpenRequest,
    RecorderStatus,
    ResetReply,
    TaskReply,
    TaskRequest,
    TaskStatus,
)
from fras_common.scenario import PatientSection, RunSection, Scenario, resolve
from fras_common.topics import (
    ACTION_RESULT,
    MOTION_RESET,
    RECORDER_OPEN,
    RECORDER_STATUS,
    TASK,
    TASK_STATUS,
)
from fras_planner.service import PlannerService
from support.shells import ShellBench

SCENARIO = resolve(Scenario(run=RunSection(peer_timeout_s=0.2)))


class Bench(ShellBench):
    """The planner, and a client; a recorder answers if asked to."""

    def __init__(self) -> None:
        super().__init__("planner", PlannerService, client="cli/test")
        self.statuses: list[TaskStatus] = self.heard(TASK_STATUS)

    def answer_recorder(self) -> None:
        def open_log(call: Any) -> None:
            request: OpenRequest = call.request
            digest = content_digest(request.trial, request.scenario, request.mesh)
            call.reply(ResetReply(digest=digest))

        self.client.serve(RECORDER_OPEN, open_log)

    def task(self, **fields: Any) -> list[TaskReply]:
        """Ask `planner/task`; the list fills when the answer comes."""
        settings: dict[str, Any] = {"command": "start", "trial": "t", **fields}
        return self.ask(TASK, TaskRequest(**settings))

    def run_until(self, condition: Any) -> None:
        deadline_s = time.monotonic() + 20
        while not condition() and time.monotonic() < deadline_s:
            self.host.drain(0.02)
            self.service.wake()
        assert condition()


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


def test_start_needs_a_resolved_scenario(bench: Bench) -> None:
    (none,) = bench.task()
    assert not none.accepted
    assert none.reason == "no resolved scenario came with the start: resolve it first"
    (unresolved,) = bench.task(scenario=Scenario())
    assert not unresolved.accepted
    assert bench.statuses == []


def test_a_trial_with_a_patient_is_refused_where_none_is(bench: Bench) -> None:
    scenario = msgspec.structs.replace(SCENARIO, patient=PatientSection())
    (refused,) = bench.task(scenario=scenario)
    assert not refused.accepted
    assert "no process `patient`" in refused.reason
    assert "--compose twin" in refused.reason
    assert bench.statuses == []
    bench.client.announce("alive/patient")
    bench.settle()
    answers = bench.task(scenario=scenario)
    bench.run_until(lambda: answers)
    assert answers[0].reason == "hold:recorder"


def test_start_without_a_recorder_is_refused_with_the_reason(bench: Bench) -> None:
    answers = bench.task(scenario=SCENARIO)
    bench.run_until(lambda: answers)
    assert (answers[0].accepted, answers[0].reason) == (False, "hold:recorder")
    assert [status.phase for status in bench.statuses] == ["resetting", "ended", "idle"]
    assert bench.statuses[-1].outcome == "aborted"


def test_trial_that_began_ends_by_name_when_a_service_is_missing(bench: Bench) -> None:
    bench.answer_recorder()
    answers = bench.task(scenario=SCENARIO)
    bench.run_until(lambda: bench.statuses and bench.statuses[-1].phase == "idle")
    assert answers[0].accepted
    assert (bench.statuses[-1].outcome, bench.statuses[-1].reason) == ("aborted", "hold:motion")
    again = bench.task(scenario=SCENARIO, trial="t2")
    bench.run_until(lambda: again)
    assert again[0].accepted


def test_one_trial_at_a_time_and_abort_names_its_trial(bench: Bench) -> None:
    answers: list[Any] = []
    bench.client.serve(RECORDER_OPEN, answers.append)  # never answered: the trial stays begun
    first = bench.task(scenario=SCENARIO)
    second = bench.task(scenario=SCENARIO, trial="t2")
    assert second[0].reason == "trial 't' is under way: let it end first"
    (wrong,) = bench.task(command="abort", trial="t2")
    assert not wrong.accepted
    (right,) = bench.task(command="abort", trial="t", reason="surgeon said so")
    assert right.accepted
    bench.run_until(lambda: bench.statuses[-1].phase == "idle")
    assert bench.statuses[-1].outcome == "aborted"
    assert bench.statuses[-1].reason.startswith("surgeon said so")
    assert not first[0].accepted


def test_health_tells_which_knowledge_is_used(bench: Bench) -> None:
    assert len(bench.host.facts["asp_digest"]) == 64


def test_the_log_gets_the_rules_that_health_tells_of(bench: Bench) -> None:
    opened: list[Any] = []
    bench.client.serve(RECORDER_OPEN, opened.append)
    bench.task(scenario=SCENARIO)
    bench.run_until(lambda: opened)
    rules = opened[0].request.rules
    assert {"domain.lp", "verify.lp", "preferences/lex.lp"} <= set(rules)
    assert rules_digest(rules) == bench.host.facts["asp_digest"]


def disk_full() -> RecorderStatus:
    return RecorderStatus(
        trial="t", state="error", path="", messages=0, bytes=0, lost=0, reason="disk full"
    )


def test_log_that_can_not_be_written_ends_the_trial(bench: Bench) -> None:
    bench.answer_recorder()
    bench.client.serve(MOTION_RESET, lambda call: None)  # the trial stays in its reset
    bench.task(scenario=SCENARIO)
    bench.peers(RECORDER_STATUS).put(disk_full())
    bench.run_until(lambda: bench.statuses[-1].phase == "idle")
    assert bench.statuses[-1].outcome == "aborted"
    assert bench.statuses[-1].reason == "hold:recorder: disk full"


def recorder_starts() -> RecorderStatus:
    return RecorderStatus(trial="", state="idle", path="", messages=0, bytes=0, lost=0, reason="")


def test_a_recorder_that_starts_anew_is_asked_to_go_on_with_the_log(bench: Bench) -> None:
    bench.answer_recorder()
    bench.client.serve(MOTION_RESET, lambda call: None)  # the trial stays in its reset
    bench.task(scenario=SCENARIO, out_dir="/somewhere")
    bench.run_until(lambda: bench.statuses)
    asked: list[Any] = []
    bench.client.serve(RECORDER_OPEN, asked.append)
    recorder = bench.peers(RECORDER_STATUS)
    recorder.put(recorder_starts())
    bench.run_until(lambda: asked)
    assert (asked[0].request.trial, asked[0].request.directory) == ("t", "/somewhere")
    # And one that can't do it ends the trial.
    asked[0].fail(FrasError("another log is in the way"))
    bench.run_until(lambda: bench.statuses[-1].phase == "idle")
    assert "hold:recorder: " in bench.statuses[-1].reason
    assert "another log is in the way" in bench.statuses[-1].reason


def test_a_recorder_that_starts_while_no_log_is_open_is_left_alone(bench: Bench) -> None:
    asked: list[Any] = []
    bench.client.serve(RECORDER_OPEN, asked.append)
    bench.peers(RECORDER_STATUS).put(recorder_starts())
    bench.task(scenario=SCENARIO)
    bench.peers(RECORDER_STATUS).put(recorder_starts())
    bench.run_until(lambda: asked)
    while bench.host.drain(0.05):
        pass
    assert len(asked) == 1


def test_a_trial_that_needs_no_log_goes_on_without(bench: Bench) -> None:
    bench.answer_recorder()
    waiting: list[Any] = []
    bench.client.serve(MOTION_RESET, waiting.append)
    run = RunSection(peer_timeout_s=0.2, require_log=False)
    bench.task(scenario=resolve(Scenario(run=run)))
    bench.run_until(lambda: waiting)
    bench.peers(RECORDER_STATUS).put(disk_full())
    bench.settle()
    assert bench.statuses[-1].phase == "resetting"


def test_a_result_that_nobody_awaits_is_kept_for_a_while_and_drives_nothing(bench: Bench) -> None:
    """One called "" was taken for an answer while none was awaited; found by the fuzz."""
    asked: list[Any] = []
    bench.client.serve(RECORDER_OPEN, asked.append)  # never answered: the executive waits for it
    bench.task(scenario=SCENARIO)
    before = list(bench.statuses)
    results = bench.client.publisher(ACTION_RESULT)
    for number in range(100):
        for goal_id in ("", f"g{number}"):
            results.put(
                ActionResult(
                    trial="t", goal_id=goal_id, name="reach", arm="psm1", block="b(1,1)",
                    outcome="succeeded", reason="",
                )
            )  # fmt: skip
        bench.settle()
    assert (len(asked), bench.statuses) == (1, before)
    (ended,) = bench.task(command="abort", trial="t")
    assert ended.accepted
