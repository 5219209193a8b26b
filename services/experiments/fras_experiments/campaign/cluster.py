"""Where workers come from: processes of our own, or a Dask cluster that is there."""

import logging
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from distributed import Client, LocalCluster

from fras_cli.trial import NobodyRunsTrials

CONNECT_S: Final = 10
WORKERS_S: Final = 30
POLL_S: Final = 0.2
NO_DASHBOARD: Final = "no dashboard: Dask draws it with bokeh, which is not installed"


class DeadScheduler(NobodyRunsTrials):
    """Nobody answers where the scheduler is to be. Attributes: ``address``."""


class NoWorker(NobodyRunsTrials):
    """A cluster without workers. Attributes: ``address``."""


@contextmanager
def connected(
    workers: int, scheduler: str | None, scratch: Path, stop: Callable[[], bool]
) -> Generator[Client]:
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
    # Whatever of it matters is told in our own words.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    if scheduler is not None:
        with _client(scheduler, stop) as client:
            yield client
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
    with LocalCluster(**options) as cluster, _client(cluster.scheduler_address, stop) as client:
        yield client


def dashboard_of(client: Client) -> str:
    """Return the link of the cluster's dashboard, or why there is none."""
    # bokeh is 60 MB with what it needs: the link is for who has it already.
    return f"dashboard {client.dashboard_link}" if find_spec("bokeh") else NO_DASHBOARD


@contextmanager
def _client(address: str, stop: Callable[[], bool]) -> Generator[Client]:
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise DeadScheduler(
            f"no Dask scheduler answers at {address} ({error}): start one with `dask scheduler`, "
            "or leave out --scheduler",
            address=address,
        ) from error
    try:
        with client:
            until_s = time.monotonic() + WORKERS_S
            while not client.nthreads() and not stop():
                if time.monotonic() > until_s:
                    raise no_worker(address)
                time.sleep(POLL_S)
            yield client
    finally:
        client.close(timeout=1)


def no_worker(address: str) -> NoWorker:
    """Tell that nobody works for a scheduler."""
    return NoWorker(
        f"the scheduler at {address} has had no worker for {WORKERS_S} s: start some with "
        f"`dask worker {address} --nthreads 1`; --out goes on",
        address=address,
    )
