"""What the processes use, and the report of one of them."""

from collections.abc import Mapping
from contextlib import suppress

import psutil

from fras_common.messages import ProcessReport
from fras_common.service.health import ProcessMeter
from fras_supervisor.runner import Status


class Usage:
    """Processor share and memory of each process, as last measured."""

    def __init__(self) -> None:
        self._meters: dict[int, ProcessMeter] = {}
        self._used: dict[str, tuple[float, int]] = {}

    def measure(self, pids: Mapping[str, int]) -> None:
        """Measure those that live; one that ends meanwhile uses nothing."""
        self._used = {}
        for name, pid in pids.items():
            with suppress(psutil.NoSuchProcess):
                meter = self._meters.setdefault(pid, ProcessMeter(pid))
                self._used[name] = (meter.cpu_percent(), meter.rss_bytes())
        self._meters = {pid: self._meters[pid] for pid in pids.values() if pid in self._meters}

    def rss_bytes(self, name: str) -> int:
        """Resident memory; 0 if it did not live."""
        return self._used.get(name, (0.0, 0))[1]

    def forget(self, name: str) -> None:
        """Forget what was measured: it has been killed."""
        self._used.pop(name, None)

    def report(self, one: Status) -> ProcessReport:
        """Put where a process stands and what it uses into a message."""
        cpu_percent, rss_bytes = self._used.get(one.name, (0.0, 0))
        return ProcessReport(
            name=one.name,
            state=one.state,
            pid=one.pid if one.up_s and one.pid else 0,
            restarts=one.restarts,
            last_exit=one.last_exit,
            starts_in_s=one.starts_in_s,
            up_s=one.up_s,
            cpu_percent=cpu_percent,
            rss_bytes=rss_bytes,
            log_lost_bytes=one.log_lost_bytes,
        )
