"""What the processes of a stack use, looked at from outside, and what they say of themselves."""

import threading
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Final

import psutil

from fras_common.bus import Bus
from fras_common.messages import Health, SupervisorStatus
from fras_common.topics import HEALTH, SERVICES, SUPERVISOR_STATUS

COMMAND: Final = "command"
"""This process: supervisor and command line."""
STACK: Final = "stack"
TIMEOUT_S: Final = 30.0


class ProcessGone(RuntimeError):
    """A process that was not there any more: one was started in its place, or none."""


class Watch:
    """Knows the processes of a stack by their names, and the last health of each service.

    Parameters
    ----------
    bus : Bus
    others : mapping of str to int
        Process ids that no supervisor knows, by name.
    """

    def __init__(self, bus: Bus, others: Mapping[str, int] = MappingProxyType({})) -> None:
        self._changed = threading.Condition()
        self._pids: dict[str, int] = {}
        self._health: dict[str, Health] = {}
        self._speak = {*SERVICES, *others}
        bus.subscribe(SUPERVISOR_STATUS, self._on_status)
        bus.subscribe(HEALTH, self._on_health)
        with self._changed:
            if not self._changed.wait_for(lambda: bool(self._pids), TIMEOUT_S):
                raise ProcessGone("no supervisor says which processes there are")
            self._processes = {COMMAND: psutil.Process()} | {
                name: psutil.Process(pid) for name, pid in (self._pids | dict(others)).items()
            }

    def sample(self, log_dir: Path) -> dict[str, dict[str, float]]:
        """Look at each process, and at what its services have counted.

        Raises
        ------
        ProcessGone
            One was started again: its memory begins anew.
        """
        self._await_health()
        found: dict[str, dict[str, float]] = {}
        for name, process in self._processes.items():
            try:
                found[name] = used(process)
            except psutil.NoSuchProcess as error:
                raise ProcessGone(f"{name} has ended: a soak is of one life") from error
        for name, health in self._health.items():
            if name in found:
                found[name] |= counted(health)
        logs_bytes = sum(file.stat().st_size for file in log_dir.iterdir())
        found[STACK] = {"logs_mib": logs_bytes / 2**20}
        return found

    def _await_health(self) -> None:
        """Wait until each service has spoken since now."""
        with self._changed:
            self._health.clear()
            if not self._changed.wait_for(lambda: self._health.keys() >= self._speak, TIMEOUT_S):
                silent = ", ".join(self._speak - self._health.keys())
                raise ProcessGone(f"no health of {silent}")

    def _on_status(self, status: SupervisorStatus) -> None:
        with self._changed:
            self._pids = {one.name: one.pid for one in status.processes if one.pid}
            self._changed.notify_all()

    def _on_health(self, health: Health) -> None:
        with self._changed:
            self._health[health.service] = health
            self._changed.notify_all()


def used(process: psutil.Process) -> dict[str, float]:
    """What a process uses: memory that nobody shares with it, descriptors, threads, files."""
    with process.oneshot():
        return {
            "memory_mib": process.memory_full_info().uss / 2**20,
            "rss_mib": process.memory_info().rss / 2**20,
            "descriptors": process.num_fds(),
            "threads": process.num_threads(),
            "files": len(process.open_files()),
        }


def counted(health: Health) -> Mapping[str, float]:
    """What a service has counted since its start, and what waits."""
    return {
        "gaps": health.gaps,
        "dropped": health.queue_dropped,
        "malformed": health.malformed,
        "refused": health.refused,
        "wrong_trial": health.wrong_trial,
        "waiting": health.queue_depth,
    }
