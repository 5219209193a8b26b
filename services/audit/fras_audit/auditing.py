"""The services that can be audited, and the order in which they are."""

import importlib
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import cast

from fras_audit.comparison import Tally
from fras_audit.progress import Progress
from fras_audit.reading import read_recorded
from fras_audit.recorded import Recorded
from fras_audit.report import Report
from fras_common.errors import FrasError

# By how long it takes: a fault in the fast ones is told before the tissue is computed.
SERVICES: tuple[str, ...] = ("sa", "planner", "motion", "sim", "patient")

Audit = Callable[[Recorded, Progress], list[Tally]]


def audit_log(path: Path, only: Sequence[str], progress: Progress) -> Report:
    """Derive what a log records again from what it records.

    Parameters
    ----------
    path : Path
        An `audit.mcap`; it is only read.
    only : sequence of str
        Services to audit.
    progress : callable
        Gets service, done and total.

    Raises
    ------
    NoSuchLog, NotAnMcap, ForeignLog, ScenarioError
        There is nothing to audit.
    """
    began_s = time.perf_counter()
    recorded = read_recorded(path)
    tallies = [tally for name in only for tally in _audit(name, recorded, progress)]
    return Report(
        path=recorded.path,
        trial=recorded.trial,
        damage=recorded.damage,
        malformed=recorded.malformed,
        gaps=recorded.gaps,
        tallies=tuple(tallies),
        took_s=time.perf_counter() - began_s,
    )


def _audit(name: str, recorded: Recorded, progress: Progress) -> list[Tally]:
    # Imported when asked for: an audit of the planner alone needs no finite elements.
    audit = cast("Audit", importlib.import_module(f"fras_audit.{name}").audit)
    try:
        return audit(recorded, progress)
    except FrasError as error:
        # A log may hold anything, a scenario that no service would have taken among it.
        return [Tally(name, "all", 0, notes=[f"nothing derived: {error}"])]
