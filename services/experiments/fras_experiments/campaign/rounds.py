"""Handing out the trials of a campaign, and keeping what comes back, until none is left."""

import queue
import time
import uuid
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import msgspec
from distributed import Client, Future

from fras_cli.trial import NobodyRunsTrials
from fras_experiments.campaign.cluster import WORKERS_S, DeadScheduler, no_worker
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
    own : bool
        Whether the workers are ours.
    stop : callable
        True ends it at once.
    tell : callable
        Gets each trial that has been kept.
    """

    store: Store
    prepared: Prepared
    keep: str
    own: bool
    stop: Callable[[], bool]
    tell: Callable[[TrialSpec, Record], None]

    def run(self, client: Client, left: Mapping[int, TrialSpec]) -> dict[int, Record]:
        """Run the trials that are left, by their numbers; return the records of those that ended.

        Raises
        ------
        DeadScheduler, NoWorker
            The cluster has gone.
        WorkerUnable
            A worker can't start a stack, or has other code.
        StoreUnwritable
        """
        name = f"campaign-{uuid.uuid4().hex[:8]}"
        keeper = Keeper(name, self.prepared.mesh, self.keep, code_digest(), own=self.own)
        ended: queue.SimpleQueue[Future] = queue.SimpleQueue()
        futures: dict[str, tuple[TrialSpec, Future]] = {}
        records: dict[int, Record] = {}
        client.register_plugin(keeper)
        try:
            for number, one in left.items():
                task = Task(name, number, msgspec.json.encode(one.scenario))
                future = client.submit(run_task, task, key=f"{name}-{number}", pure=False)
                futures[future.key] = (one, future)
                future.add_done_callback(ended.put)
            looked_s = worked_s = time.monotonic()
            while futures and not self.stop():
                try:
                    one, future = futures.pop(ended.get(timeout=POLL_S).key)
                    done = self._outcome(client, one, future)
                    records[one.number] = self._kept(one, done)
                except queue.Empty:
                    pass
                if time.monotonic() - looked_s > LOOK_S:
                    looked_s = time.monotonic()
                    worked_s = looked_s if self._workers(client) else worked_s
                    if looked_s - worked_s > WORKERS_S:
                        raise no_worker(client.scheduler.address if client.scheduler else "?")
        finally:
            self._part(client, name, [future for _, future in futures.values()])
        return records

    def _outcome(self, client: Client, one: TrialSpec, future: Future) -> Done:
        if future.status == "finished":
            return future.result()
        if future.status in ("cancelled", "lost"):
            raise self._dead(client)
        # It was tried on three workers, and each died of it.
        reason = f"worker: {type(future.exception()).__name__}"
        result = without_result(one.scenario, reason)
        timing = Timing(worker="", wall_s=0.0, cpu_s=0.0)
        return Done(one.number, Record(code=self.store.code, result=result, timing=timing), {})

    def _kept(self, one: TrialSpec, done: Done) -> Record:
        if done.record is None:
            raise WorkerUnable(
                f"{done.problem}; what was kept is whole: mend it, and give the same command with "
                f"--out {self.store.folder}"
            )
        record = self.store.put(one.number, done.record, done.files)
        self.tell(one, record)
        return record

    def _workers(self, client: Client) -> int:
        try:
            return len(client.nthreads())
        except (OSError, TimeoutError) as error:
            raise self._dead(client) from error

    def _dead(self, client: Client) -> DeadScheduler:
        address = client.scheduler.address if client.scheduler else "its address"
        return DeadScheduler(
            f"the scheduler at {address} has gone; what was kept is whole: give the same command "
            f"with --out {self.store.folder} to go on",
            address=address,
        )

    def _part(self, client: Client, name: str, futures: list[Future]) -> None:
        """Leave the cluster as it was: nothing to do, no stack of ours."""
        try:
            client.cancel(futures, force=True)
            client.unregister_worker_plugin(name)
        except (OSError, TimeoutError, ValueError, RuntimeError):
            # There is nobody to part from; workers end their stacks by themselves.
            return
