"""Handing out the trials of a campaign, and keeping what comes back, until none is left."""

import time
import uuid
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import msgspec

from fras_cli.trial import NobodyRunsTrials
from fras_experiments.campaign.cluster import WORKERS_S, Cluster
from fras_experiments.campaign.code import code_digest
from fras_experiments.campaign.keeper import Done, Keeper, Task, run_task
from fras_experiments.campaign.reading import Prepared
from fras_experiments.campaign.records import Record, Timing, without_result
from fras_experiments.campaign.spec import TrialSpec
from fras_experiments.campaign.store import Store

POLL_S: Final = 0.2
LOOK_S: Final = 5.0


class WorkerUnable(NobodyRunsTrials):
    """A worker can't run trials at all."""


@dataclass
class Round:
    """One command's part of a campaign.

    Attributes
    ----------
    keep : {"failed", "all", "none"}
        Whose logs are kept.
    stop : callable
        True ends it at once.
    tell : callable
        Gets each trial that has been kept.
    """

    store: Store
    prepared: Prepared
    keep: str
    stop: Callable[[], bool]
    tell: Callable[[TrialSpec, Record], None]

    def run(self, cluster: Cluster, left: Mapping[int, TrialSpec]) -> None:
        """Run the trials that are left, by their numbers, until all have ended.

        Raises
        ------
        DeadScheduler, NoWorker
            The cluster has gone.
        WorkerUnable
            A worker can't start a stack, or has other code.
        StoreUnwritable
        """
        name = f"campaign-{uuid.uuid4().hex[:8]}"
        keeper = Keeper(
            name,
            self.prepared.mesh,
            self.keep,
            code_digest(),
            own=cluster.own,
            rules=self.prepared.rules,
        )
        until = self.prepared.campaign.until
        tasks = {
            number: Task(name, number, msgspec.json.encode(one.scenario), until)
            for number, one in left.items()
        }
        waiting = dict(left)
        try:
            cluster.begin(name, keeper)
            cluster.hand_out(run_task, tasks)
            looked_s = worked_s = time.monotonic()
            while waiting and not self.stop():
                if (come := cluster.next(POLL_S)) is not None:
                    number, done = come
                    self._take(waiting.pop(number), done)
                if (now_s := time.monotonic()) - looked_s > LOOK_S:
                    looked_s = now_s
                    worked_s = now_s if cluster.workers() else worked_s
                    if now_s - worked_s > WORKERS_S:
                        raise cluster.without_workers()
        finally:
            cluster.part()

    def _take(self, one: TrialSpec, done: object) -> None:
        """Keep what came of a trial."""
        if not isinstance(done, Done):
            # Each of the workers that it was tried on died.
            result = without_result(one.scenario, f"worker: {type(done).__name__}")
            timing = Timing(worker="", wall_s=0.0, cpu_s=0.0)
            record = Record(code=self.store.code, result=result, timing=timing)
            done = Done(one.number, record, {})
        if done.record is None:
            raise WorkerUnable(
                f"{done.problem}; what was kept is whole: mend it, and give the same command with "
                f"--out {self.store.folder}"
            )
        self.tell(one, self.store.put(one.number, done.record, done.files))
