"""The round of trials: each worker keeps a stack, and takes the next number that nobody has."""

import os
import queue
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from fras_cli.options import TrialInput
from fras_cli.trial import StackDied, TrialRefused
from fras_common.bus import NoAnswer
from fras_experiments.chaos.draw import draw
from fras_experiments.chaos.faults import Kind, Stretch
from fras_experiments.chaos.injector import Injected
from fras_experiments.chaos.invariants import Breach, Undisturbed
from fras_experiments.chaos.results import Campaign, TrialRecord, save
from fras_experiments.chaos.stage import Stage, staged
from fras_experiments.chaos.trials import judge, undisturbed_of

PATIENCE_S = 300.0
RESULT = "chaos.json"
Reference = tuple[Undisturbed, tuple[Stretch, ...], int]


@dataclass(frozen=True)
class Asked:
    """What a campaign is to do.

    Attributes
    ----------
    numbers : sequence of int
        Trials, by their number in the draw.
    given : TrialInput
        The trial that is repeated.
    audit : bool
        Derive each decision again, too.
    """

    scenario: str
    given: TrialInput
    seed: int
    numbers: Sequence[int]
    kinds: tuple[Kind, ...]
    out: Path
    workers: int = 1
    audit: bool = False


@dataclass
class _Round:
    """What the workers share."""

    asked: Asked
    stop: Callable[[], bool]
    tell: Callable[[TrialRecord], None]
    load: float
    left: queue.SimpleQueue[int] = field(default_factory=queue.SimpleQueue[int])
    reference: Future[Reference] = field(default_factory=Future[Reference])
    records: list[TrialRecord] = field(default_factory=list[TrialRecord])
    lock: threading.Lock = field(default_factory=threading.Lock)

    def add(self, record: TrialRecord) -> None:
        """Take a trial's record down at once: a campaign that is killed loses none."""
        with self.lock:
            self.records.append(record)
            save(self.campaign(), self.asked.out / RESULT)
            self.tell(record)

    def campaign(self) -> Campaign:
        """All of it so far."""
        undisturbed, _, ticks = self.reference.result()
        return Campaign(
            scenario=self.asked.scenario,
            seed=self.asked.seed,
            kinds=self.asked.kinds,
            asked=len(self.asked.numbers),
            undisturbed_ticks=ticks,
            undisturbed_force_n=undisturbed.max_force_n,
            load=(round(self.load, 2), round(os.getloadavg()[0], 2)),
            cores=os.cpu_count() or 1,
            trials=tuple(sorted(self.records, key=lambda one: one.number)),
        )


def run(
    asked: Asked,
    stop: Callable[[], bool] = lambda: False,
    tell: Callable[[TrialRecord], None] = lambda record: None,
) -> Campaign:
    """Run a campaign; its results stand in `chaos.json` after each trial.

    Parameters
    ----------
    stop : callable
        True ends it: the trials under way are ended, and the results so far returned.
    tell : callable
        Gets each trial's record, on the thread of its worker.

    Raises
    ------
    FrasError
        No stack could be started, or the undisturbed trial has no ticks.
    """
    round_ = _Round(asked, stop, tell, os.getloadavg()[0])
    for number in asked.numbers:
        round_.left.put(number)
    with ThreadPoolExecutor(asked.workers, "chaos") as pool:
        workers = [pool.submit(_work, round_, index) for index in range(asked.workers)]
        for worker in workers:
            worker.result()
    return round_.campaign()


def _work(round_: _Round, worker: int) -> None:
    """Keep a stack, and another one where one has died of it."""
    lives = 0
    while not round_.stop():
        folder = round_.asked.out / "stacks" / f"{worker}.{lives}"
        lives += 1
        try:
            with staged(f"chaos-{os.getpid()}-{worker}", round_.asked.kinds, folder) as stage:
                _refer(round_, stage, worker)
                if not _take_turns(round_, stage):
                    return
        except BaseException as error:
            # The others wait for the undisturbed trial.
            if worker == 0 and not round_.reference.done():
                round_.reference.set_exception(error)
            raise


def _refer(round_: _Round, stage: Stage, worker: int) -> None:
    """Run the trial in which nothing happens, once."""
    if worker == 0 and not round_.reference.done():
        asked = round_.asked
        folder = asked.out / "undisturbed"
        log, _ = stage.run("undisturbed", asked.given, folder, (), round_.stop)
        round_.reference.set_result(undisturbed_of(log))
    round_.reference.result()


def _take_turns(round_: _Round, stage: Stage) -> bool:
    """Run what is left, trial by trial; true if another stack must go on."""
    while not round_.stop():
        try:
            number = round_.left.get_nowait()
        except queue.Empty:
            return False
        record, alive = _one(round_, stage, number)
        if not round_.stop():
            round_.add(record)
        if not alive:
            return True
    return False


def _one(round_: _Round, stage: Stage, number: int) -> tuple[TrialRecord, bool]:
    asked = round_.asked
    undisturbed, course, _ = round_.reference.result()
    folder = asked.out / f"trial-{number:03d}"
    faults = draw(asked.seed, number, asked.kinds, course)
    began_s = time.monotonic()
    log, injected = folder / "audit.mcap", tuple(Injected(fault) for fault in faults)

    def late() -> bool:
        return round_.stop() or time.monotonic() - began_s > PATIENCE_S

    died = ""
    try:
        log, injected = stage.run(f"chaos-{asked.seed}-{number}", asked.given, folder, faults, late)
        alive = stage.ready()
    except (StackDied, TrialRefused, NoAnswer) as error:
        alive, died = False, str(error)
    wall_s = time.monotonic() - began_s
    record = judge(number, log, asked.out, injected, undisturbed, wall_s, audit=asked.audit)
    if died:
        breach = Breach("ends", f"the stack serves trials no more: {died}")
        record = msgspec.structs.replace(record, breaches=(*record.breaches, breach))
    return record, alive
