"""Where workers come from: processes of our own, or a Dask cluster that is there."""

import logging
from collections.abc import Generator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from distributed import Client, LocalCluster

from fras_cli.trial import NobodyRunsTrials

CONNECT_S: Final = 10
WORKERS_S: Final = 30
NO_DASHBOARD: Final = "no dashboard: Dask draws it with bokeh, which is not installed"


class DeadScheduler(NobodyRunsTrials):
    """Nobody answers where the scheduler is to be. Attributes: ``address``."""


class NoWorker(NobodyRunsTrials):
    """A cluster without workers. Attributes: ``address``."""


@contextmanager
def connected(workers: int, scheduler: str | None, scratch: Path) -> Generator[Client]:
    """Start workers of our own, or use those of a cluster; within the block.

    Parameters
    ----------
    workers : int
        How many, where no scheduler is given.
    scheduler : str or None
        Address, as `tcp://10.0.0.5:8786`.
    scratch : Path
        Where our own workers lay their files.

    Raises
    ------
    DeadScheduler, NoWorker
    """
    if scheduler is not None:
        with _client(scheduler) as client:
            yield client
        return
    # bokeh is 60 MB with what it needs: the link is for who has it already.
    dashboard = ":0" if find_spec("bokeh") else None
    options: dict[str, Any] = {
        "n_workers": workers,
        "threads_per_worker": 1,
        "processes": True,
        "memory_limit": None,
        "dashboard_address": dashboard,
        "local_directory": str(scratch),
        "silence_logs": logging.CRITICAL,
    }
    with LocalCluster(**options) as cluster, _client(str(cluster.scheduler_address)) as client:
        yield client


def dashboard_of(client: Client) -> str:
    """Return the link of the cluster's dashboard, or why there is none."""
    return f"dashboard {client.dashboard_link}" if client.dashboard_link else NO_DASHBOARD


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
        with client:
            try:
                client.wait_for_workers(1, timeout=WORKERS_S)
            except TimeoutError as error:
                raise no_worker(address) from error
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
