"""The planner's shell on an in-memory bus: one trial at a time, every start answered once."""

import time
from collections.abc import Iterator
from typing import Any

import pytest

from fras_common.codec import content_digest
from fras_common.messages import (
    OpenRequest,
    RecorderStatus,
    ResetReply,
    TaskReply,
    TaskRequest,
    TaskStatus,
)
from fras_common.scenario import RunSection, Scenario, resolve
from fras_common.topics import MOTION_RESET, RECORDER_OPEN, RECORDER_STATUS, TASK, TASK_STATUS
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
    assert (none.accepted, none.reason) == (False, "start needs a resolved scenario")
    (unresolved,) = bench.task(scenario=Scenario())
    assert not unresolved.accepted
    assert bench.statuses == []


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
    assert second[0].reason == "trial t is under way"
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


def disk_full() -> RecorderStatus:
    return RecorderStatus(
        trial="t", state="error", path="", messages=0, bytes=0, lost=0, reason="disk full"
    )


def test_log_that_can_not_be_written_ends_the_trial(bench: Bench) -> None:
    bench.answer_recorder()
    bench.client.serve(MOTION_RESET, lambda call: None)  # the trial stays in its reset
    bench.task(scenario=SCENARIO)
    bench.client.publisher(RECORDER_STATUS).put(disk_full())
    bench.run_until(lambda: bench.statuses[-1].phase == "idle")
    assert bench.statuses[-1].outcome == "aborted"
    assert bench.statuses[-1].reason == "hold:recorder: disk full"


def test_a_trial_that_needs_no_log_goes_on_without(bench: Bench) -> None:
    bench.answer_recorder()
    waiting: list[Any] = []
    bench.client.serve(MOTION_RESET, waiting.append)
    run = RunSection(peer_timeout_s=0.2, require_log=False)
    bench.task(scenario=resolve(Scenario(run=run)))
    bench.run_until(lambda: waiting)
    bench.client.publisher(RECORDER_STATUS).put(disk_full())
    bench.settle()
    assert bench.statuses[-1].phase == "resetting"
