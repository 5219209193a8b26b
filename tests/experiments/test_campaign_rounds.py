"""Trials handed out and what comes back: kept, told, or a reason to end."""

from collections.abc import Callable, Generator, Mapping
from pathlib import Path
from typing import Any, cast

import msgspec
import pytest

from fras_cli.trial import NobodyRunsTrials
from fras_experiments.campaign import rounds
from fras_experiments.campaign.cluster import Cluster, NoWorker
from fras_experiments.campaign.keeper import Done, Task
from fras_experiments.campaign.progress import Pace
from fras_experiments.campaign.reading import Prepared, prepare
from fras_experiments.campaign.records import Record, Timing, without_result
from fras_experiments.campaign.rounds import Round, WorkerUnable
from fras_experiments.campaign.store import Store, opened


class Played:
    """A cluster that answers as it is told."""

    own = True

    def __init__(self, answer: Callable[[Any], object], workers: int = 1) -> None:
        self.answer = answer
        self.count = workers
        self.left: list[tuple[int, Any]] = []
        self.parted = 0

    def begin(self, name: str, plugin: Any) -> None:
        assert plugin.name == name

    def hand_out(self, run: Any, tasks: Mapping[int, Any]) -> None:
        self.left = list(tasks.items())

    def next(self, timeout_s: float) -> tuple[int, object] | None:
        if not self.count:
            return None
        number, task = self.left.pop()
        return number, self.answer(task)

    def workers(self) -> int:
        return self.count

    def without_workers(self) -> NoWorker:
        return NoWorker("no worker")

    def part(self) -> None:
        self.parted += 1


@pytest.fixture
def prepared() -> Prepared:
    return prepare("retraction", seeds="0..1", mesh="11,13,2")


@pytest.fixture
def store(tmp_path: Path, prepared: Prepared) -> Generator[Store]:
    with opened(tmp_path, prepared, "code") as kept:
        yield kept


def run(store: Store, prepared: Prepared, played: Played, stop: Any = lambda: False) -> list[int]:
    told: list[int] = []
    left = {one.number: one for one in prepared.trials}
    round_ = Round(store, prepared, "failed", stop, lambda one, record: told.append(one.number))
    try:
        round_.run(cast("Cluster", played), left)
    finally:
        assert played.parted == 1
    return told


def done(task: Any, outcome: str = "success") -> Done:
    result = without_result(prepare("retraction", seeds="0..0").trials[0].scenario, outcome)
    record = Record(code="code", result=result, timing=Timing(worker="0", wall_s=1.0, cpu_s=1.0))
    return Done(task.number, record, {})


def test_each_trial_is_kept_in_whatever_order_it_comes(store: Store, prepared: Prepared):
    assert run(store, prepared, Played(done)) == [3, 2, 1, 0]
    assert set(store.load().records) == {0, 1, 2, 3}


def test_a_trial_that_no_worker_survives_is_told_and_the_rest_goes_on(
    store: Store, prepared: Prepared
):
    class KilledWorker(Exception):
        pass

    played = Played(lambda task: KilledWorker() if task.number == 2 else done(task))
    assert len(run(store, prepared, played)) == 4
    result = store.load().records[2].result
    assert (result.outcome, result.reason) == ("aborted", "worker: KilledWorker")


def test_a_worker_that_cannot_run_trials_ends_it_and_leaves_no_result(
    store: Store, prepared: Prepared
):
    def answer(task: Any) -> Done:
        return Done(1, None, {}, "worker 0: no stack") if task.number == 1 else done(task)

    with pytest.raises(WorkerUnable, match=r"no stack.*--out") as caught:
        run(store, prepared, Played(answer))
    assert isinstance(caught.value, NobodyRunsTrials)
    assert set(store.load().records) == {2, 3}


def test_without_a_worker_it_ends(
    store: Store, prepared: Prepared, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(rounds, "LOOK_S", 0.0)
    monkeypatch.setattr(rounds, "WORKERS_S", 0.05)
    with pytest.raises(NoWorker):
        run(store, prepared, Played(done, workers=0))


def test_a_stop_is_heard_between_two_trials(store: Store, prepared: Prepared):
    played = Played(done)
    assert run(store, prepared, played, stop=lambda: len(played.left) == 2) == [3, 2]


def test_the_pace_counts_what_this_command_has_done():
    now_s = [0.0]
    before = {0: done(Task("c", 0, b"")).record}
    pace = Pace(10, cast("dict[int, Record]", before), clock=lambda: now_s[0])
    assert pace.in_words() == "0% success"
    now_s[0] = 30.0
    for number in range(3):
        record = done(Task("c", number, b"")).record
        assert record is not None
        pace.count(record)
    assert pace.in_words() == "6.0 a minute · 0:01:00 left · 0% success"


def test_the_pace_of_trials_that_end_with_their_plan_counts_plans():
    record = done(Task("c", 0, b"")).record
    assert record is not None
    planned = msgspec.structs.replace(record.result, outcome="planned")
    pace = Pace(2, {0: msgspec.structs.replace(record, result=planned)})
    assert pace.in_words() == "100% planned"
