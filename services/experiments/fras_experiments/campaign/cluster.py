"""Where workers come from: processes of our own, or a Dask cluster that is there."""

# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportMissingTypeArgument=false
# pyright: reportUnknownParameterType=false, reportArgumentType=false
# distributed does not say whether its methods wait or give a coroutine.

import logging
import queue
import time
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, cast

from distributed import Client, Future, LocalCluster, WorkerPlugin

from fras_cli.trial import NobodyRunsTrials

CONNECT_S: Final = 10
WORKERS_S: Final = 30
POLL_S: Final = 0.2
NO_DASHBOARD: Final = "no dashboard: Dask draws it with bokeh, which is not installed"
GONE: Final = ("cancelled", "lost")


class DeadScheduler(NobodyRunsTrials):
    """Nobody answers where the scheduler is to be. Attributes: ``address``."""


class NoWorker(NobodyRunsTrials):
    """A cluster without workers. Attributes: ``address``."""


class Cluster:
    """Workers that a scheduler hands tasks to; made by `connected`.

    Parameters
    ----------
    client : Client
    address : str
        Of the scheduler.
    own : bool
        Whether the workers are processes of ours.
    """

    def __init__(self, client: Client, address: str, *, own: bool) -> None:
        self.address = address
        self.own = own
        self._client = client
        self._name = ""
        self._numbers: dict[str, int] = {}
        self._futures: dict[int, Future] = {}
        self._ended: queue.SimpleQueue[str] = queue.SimpleQueue()

    def workers(self) -> int:
        """Count the workers.

        Raises
        ------
        DeadScheduler
        """
        try:
            return len(self._client.nthreads())
        except (OSError, TimeoutError, RuntimeError) as error:
            raise self._dead() from error

    def wait_for_workers(self, stop: Callable[[], bool]) -> None:
        """Wait until there is one, or `stop` says true.

        Raises
        ------
        DeadScheduler, NoWorker
        """
        until_s = time.monotonic() + WORKERS_S
        while not self.workers() and not stop():
            if time.monotonic() > until_s:
                raise self.without_workers()
            time.sleep(POLL_S)

    def begin(self, name: str, plugin: WorkerPlugin) -> None:
        """Give each worker, also those to come, a plugin under a name."""
        self._name = name
        self._client.register_plugin(plugin, name)

    def hand_out(self, run: Callable[[Any], object], tasks: Mapping[int, object]) -> None:
        """Have `run` called on a worker with each task, in their order."""
        for number, task in tasks.items():
            key = f"{self._name}-{number}"
            self._numbers[key] = number
            future = self._client.submit(run, task, key=key, pure=False)
            self._futures[number] = future
            future.add_done_callback(self._has_ended)

    def next(self, timeout_s: float) -> tuple[int, object] | None:
        """Return what comes back next, with its number; None if nothing does in time.

        An exception stands for a task that no worker survived.

        Raises
        ------
        DeadScheduler
        """
        try:
            number = self._numbers[self._ended.get(timeout=timeout_s)]
        except queue.Empty:
            return None
        future = self._futures.pop(number)
        if future.status in GONE:
            raise self._dead()
        error = cast("BaseException | None", future.exception())
        return number, future.result() if error is None else error

    def part(self) -> None:
        """Leave the workers as they were: nothing to do, without the plugin."""
        try:
            self._client.cancel(list(self._futures.values()), force=True)
            self._client.unregister_worker_plugin(self._name)
        except (OSError, TimeoutError, ValueError, RuntimeError):
            # There is nobody to part from; workers end their stacks by themselves.
            return

    def dashboard(self) -> str:
        """Return the link of the dashboard, or why there is none."""
        # bokeh is 60 MB with what it needs: the link is for who has it already.
        return f"dashboard {self._client.dashboard_link}" if find_spec("bokeh") else NO_DASHBOARD

    def without_workers(self) -> NoWorker:
        """Tell that nobody works for the scheduler."""
        return NoWorker(
            f"the scheduler at {self.address} has had no worker for {WORKERS_S} s: start some "
            f"with `dask worker {self.address} --nthreads 1`, and give the same command with the "
            "same --out",
            address=self.address,
        )

    def _has_ended(self, future: Future) -> None:
        self._ended.put(str(future.key))

    def _dead(self) -> DeadScheduler:
        return DeadScheduler(
            f"the scheduler at {self.address} has gone; what was kept is whole: give the same "
            "command with the same --out to go on",
            address=self.address,
        )


@contextmanager
def connected(
    workers: int, scheduler: str | None, scratch: Path, stop: Callable[[], bool]
) -> Generator[Cluster]:
    """Start workers of our own, or use those of a cluster; within the block.

    Parameters
    ----------
    workers : int
        How many, where no scheduler is given.
    scheduler : str or None
        Address, as `tcp://10.0.0.5:8786`.
    scratch : Path
        Where our own workers lay their files.
    stop : callable
        True ends the waiting for workers.

    Raises
    ------
    DeadScheduler, NoWorker
    """
    _silence()
    if scheduler is not None:
        with _client(scheduler) as client:
            cluster = Cluster(client, scheduler, own=False)
            cluster.wait_for_workers(stop)
            yield cluster
        return
    options: dict[str, Any] = {
        "n_workers": workers,
        "threads_per_worker": 1,
        "processes": True,
        "memory_limit": None,
        "dashboard_address": "127.0.0.1:0",
        "local_directory": str(scratch),
        "silence_logs": logging.CRITICAL,
    }
    local = LocalCluster(**options)
    with local, _client(address := str(local.scheduler_address)) as client:
        cluster = Cluster(client, address, own=True)
        cluster.wait_for_workers(stop)
        yield cluster


def _silence() -> None:
    """Leave what the libraries log: whatever of it matters is told in our own words."""
    for name in list(logging.root.manager.loggerDict):
        if name.partition(".")[0] in ("distributed", "tornado", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)


@contextmanager
def _client(address: str) -> Generator[Client]:
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise DeadScheduler(
            f"no Dask scheduler answers at {address} ({error}): start one with `dask scheduler`, "
            "or leave out --scheduler",
            address=address,
        ) from error
    try:
        yield client
    finally:
        client.close(timeout=1)
