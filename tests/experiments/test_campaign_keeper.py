"""A worker's stack: kept for many trials, replaced when it dies, ended with the worker."""

import asyncio
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest

from fras_cli.trial import StackDied, TrialView
from fras_common.errors import FrasError
from fras_common.scenario import PatientSection, Scenario, resolve
from fras_experiments.campaign import keeper
from fras_experiments.campaign.code import code_digest
from fras_experiments.campaign.keeper import Done, Keeper, Task
from fras_experiments.campaign.records import without_result

SCENARIO = resolve(Scenario(seed=3))


class Stacks:
    """Stands for the stacks of one worker."""

    def __init__(self, folder: Path, patch: pytest.MonkeyPatch) -> None:
        self.folder = folder
        self.begun: list[str] = []
        self.patients: list[bool] = []
        self.rules: list[Path | None] = []
        # One that has nothing to do, and one that has.
        self.plans = [SimpleNamespace(actions=actions) for actions in ([], ["reach"])]
        self.ends: list[str] = []
        self.ended: list[str] = []
        self.cannot_start = 0
        self.gone = ""
        self.play: Callable[[Path], bool] = lambda folder: True
        patch.setattr(keeper, "own_stack", self.own_stack)
        patch.setattr(keeper, "TrialFollower", lambda used: used)
        patch.setattr(keeper, "follow_to_end", self.follow)
        patch.setattr(keeper, "read_trial", lambda log: log)
        patch.setattr(keeper, "measure", lambda log: self.measured)
        patch.setattr(keeper, "series_of", lambda log: ())
        patch.setattr(keeper, "planning_in", lambda log, timing: timing)
        whole = without_result(SCENARIO, "visible")
        self.measured = msgspec.structs.replace(whole, outcome="success", complete=True)

    @contextmanager
    def own_stack(
        self, cell: str, connect: None, logs: Path, cancelled: Any, layout: Any
    ) -> Generator[Any]:
        if self.cannot_start:
            self.cannot_start -= 1
            raise FrasError("the port is taken")
        logs.mkdir(parents=True)
        (logs / "sim.log").write_text("what sim said", encoding="utf-8")
        self.begun.append(cell)
        self.patients.append(layout.patient)
        self.rules.append(layout.asp_dir)
        self.gone = ""
        link = SimpleNamespace(wait_complete=lambda timeout_s: True)
        yield SimpleNamespace(link=link, watch=lambda: self.gone)
        self.ended.append(cell)

    def follow(
        self, follower: Any, trial: str, given: Any, folder: Path, until: Any, **_: Any
    ) -> bool:
        views = [TrialView(), *(TrialView(plan=one) for one in self.plans)]  # type: ignore[arg-type]
        self.ends = [until(view) for view in views]
        (folder / "audit.mcap").write_bytes(b"log of " + trial.encode())
        return self.play(folder)

    def worker(self, keep: str = "failed", code: str | None = None, **given: Any) -> Keeper:
        one = Keeper("c", b"", keep, code or code_digest(), own=False, **given)
        one.setup(SimpleNamespace(name=0, local_directory=str(self.folder)))  # type: ignore[arg-type]
        return one

    def end(self, one: Keeper) -> None:
        asyncio.run(one.teardown(SimpleNamespace()))  # type: ignore[arg-type]


@pytest.fixture
def stacks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Stacks:
    return Stacks(tmp_path, monkeypatch)


def task(number: int) -> Task:
    return Task("c", number, msgspec.json.encode(SCENARIO))


def until_plan(number: int) -> Task:
    return replace(task(number), until="plan")


def outcome(done: Done) -> tuple[str, str]:
    assert done.record is not None, done.problem
    return done.record.result.outcome, done.record.result.reason


def test_rules_of_ones_own_travel_by_value_to_the_planner_of_its_stack(stacks: Stacks):
    one = stacks.worker(rules={"domain.lp": "a.", "preferences/sum.lp": "b."})
    assert outcome(one.run(task(0)))[0] == "success"
    (folder,) = stacks.rules
    assert folder is not None
    assert (folder / "preferences" / "sum.lp").read_text() == "b."
    stacks.end(one)
    other = stacks.worker()
    assert outcome(other.run(task(0)))[0] == "success"
    assert stacks.rules[1] is None
    stacks.end(other)


def test_one_stack_serves_many_trials_and_ends_with_the_worker(stacks: Stacks):
    one = stacks.worker()
    assert [outcome(one.run(task(n)))[0] for n in range(3)] == ["success"] * 3
    assert (len(stacks.begun), stacks.ended) == (1, [])
    stacks.end(one)
    assert stacks.ended == stacks.begun
    assert list(stacks.folder.iterdir()) == []
    assert one.run(task(3)).record is None


def test_a_stack_that_dies_is_replaced_and_its_trial_told_with_its_log(stacks: Stacks):
    def die(folder: Path) -> bool:
        raise StackDied("in mid-trial: sim was given up")

    one = stacks.worker()
    one.run(task(0))
    stacks.play = die
    done = one.run(task(1))
    assert outcome(done) == ("aborted", "stack: in mid-trial: sim was given up")
    assert done.files["audit.mcap"] == b"log of c-1"
    assert done.files["stack-sim.log"] == b"what sim said"
    stacks.play = lambda folder: True
    assert outcome(one.run(task(2)))[0] == "success"
    assert stacks.ended == stacks.begun[:1]
    assert len(set(stacks.begun)) == 2
    # Between two trials, too.
    stacks.gone = "recorder was given up"
    assert outcome(one.run(task(3)))[0] == "success"
    assert len(stacks.begun) == 3
    stacks.end(one)


def test_a_trial_that_never_ends_costs_the_stack(stacks: Stacks):
    stacks.play = lambda folder: False
    one = stacks.worker()
    assert outcome(one.run(task(0))) == ("aborted", f"stack: {keeper.TOO_LONG}")
    assert stacks.ended == stacks.begun
    stacks.end(one)


@pytest.mark.parametrize(
    ("keep", "ends", "files"),
    [
        ("failed", "success", 0),
        ("failed", "failed", 2),
        ("all", "success", 2),
        ("none", "failed", 0),
    ],
)
def test_logs_travel_back_as_asked(stacks: Stacks, keep: str, ends: str, files: int):
    stacks.measured = msgspec.structs.replace(stacks.measured, outcome=ends)
    one = stacks.worker(keep)
    assert len(one.run(task(0)).files) == files
    assert not list(stacks.folder.rglob("trial-*"))
    stacks.end(one)


def test_who_cannot_run_trials_says_why(stacks: Stacks, monkeypatch: pytest.MonkeyPatch):
    stacks.cannot_start = 1
    one = stacks.worker()
    # A port may be taken in between: it is tried once more.
    assert outcome(one.run(task(0)))[0] == "success"
    stacks.end(one)
    stacks.cannot_start = 2
    one = stacks.worker()
    done = one.run(task(0))
    assert done.record is None
    assert "worker 0: no stack could be started: the port is taken" in done.problem
    done = stacks.worker(code="other").run(task(0))
    assert "another version" in done.problem
    few = SimpleNamespace(free=10 * 2**20)
    monkeypatch.setattr(keeper.shutil, "disk_usage", lambda path: few)
    assert "the disk is full: 10 MiB free" in one.run(task(0)).problem
    stacks.end(one)


def test_a_log_that_cannot_be_read_is_no_result(stacks: Stacks, monkeypatch: pytest.MonkeyPatch):
    def unreadable(log: Path) -> None:
        raise FrasError("no log")

    monkeypatch.setattr(keeper, "read_trial", unreadable)
    one = stacks.worker()
    assert outcome(one.run(task(0))) == ("aborted", "stack: its log can't be read: FrasError")
    stacks.end(one)


def test_a_trial_with_a_patient_gets_a_stack_with_one(stacks: Stacks):
    one = stacks.worker()
    scenario = msgspec.structs.replace(SCENARIO, patient=PatientSection())
    twin = Task("c", 1, msgspec.json.encode(scenario))
    for asked in (task(0), twin, task(2), twin):
        assert outcome(one.run(asked))[0] == "success"
    # A stack with a patient serves trials without one, too.
    assert stacks.patients == [False, True]
    assert stacks.ended == stacks.begun[:1]
    stacks.end(one)


def test_a_trial_until_its_plan_is_ended_by_it_and_told_as_planned(stacks: Stacks):
    reason = keeper.HAS_PLAN
    stacks.measured = msgspec.structs.replace(stacks.measured, outcome="aborted", reason=reason)
    one = stacks.worker()
    done = one.run(until_plan(0))
    assert outcome(done) == ("planned", "")
    assert stacks.ends == ["", "", reason]
    # How far it came in the meantime is chance.
    assert done.record is not None
    result = done.record.result
    assert (result.plans, result.ticks, result.visibility, result.complete) == (1, None, None, True)
    assert not done.files
    assert len(stacks.begun) == 1
    # Another end of it is told as what it is.
    stacks.measured = msgspec.structs.replace(stacks.measured, reason="hold:sim")
    assert outcome(one.run(until_plan(1))) == ("aborted", "hold:sim")
    one.run(task(2))
    assert stacks.ends == ["", "", ""]
    stacks.end(one)
