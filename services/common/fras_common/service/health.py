"""What this process costs."""

import psutil


class ProcessMeter:
    """Resident memory and processor share of a process: the one that makes it, or another.

    Raises
    ------
    psutil.NoSuchProcess
        There is none of that id, then or later.
    """

    def __init__(self, pid: int | None = None) -> None:
        self._process = psutil.Process(pid)
        self._process.cpu_percent()

    def rss_bytes(self) -> int:
        """Resident memory [bytes]."""
        return int(self._process.memory_info().rss)

    def cpu_percent(self) -> float:
        """Processor share since the last call; 100 is one core."""
        return float(self._process.cpu_percent())
