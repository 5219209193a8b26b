"""On what machine a benchmark ran."""

import os
import platform
import re
from pathlib import Path
from typing import Any


def processor() -> str:
    """Name of the processor; empty where nothing tells it."""
    try:
        found = re.search(r"model name\s*:\s*(.+)", Path("/proc/cpuinfo").read_text())
    except OSError:
        found = None
    return found[1] if found else platform.processor()


def machine() -> dict[str, Any]:
    """What a report says of the machine."""
    return {"processor": processor(), "cores": os.cpu_count()}
