"""On what a service computes: equal builds give equal bits, others only equal numbers."""

import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

# Those in which a last digit may be decided.
LIBRARIES = ("fras", "numpy", "scipy", "numba", "mkl", "clingo", "pin", "ruckig")
_CPUINFO = Path("/proc/cpuinfo")


@cache
def build_of_this_process() -> str:
    """Name versions and processor in one line; two that differ may differ in the last digits."""
    versions = [f"{name} {found}" for name in LIBRARIES if (found := _version(name))]
    return "; ".join([f"Python {platform.python_version()}", *versions, _processor()])


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def _processor() -> str:
    """Model of the processor, and what kind of machine it is."""
    try:
        lines = _CPUINFO.read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return f"{next(names, platform.processor() or 'unknown processor')} ({platform.machine()})"
