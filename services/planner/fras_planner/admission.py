"""Whether a trial may be started or aborted now: no bus and no clock."""

from fras_common.errors import FrasError
from fras_common.messages import TaskRequest
from fras_common.scenario import Scenario
from fras_planner.executive import Executive

__all__ = ["TaskRefused", "require_abortable", "startable"]

NO_PATIENT = (
    "the scenario has a [patient], and no process `patient` is in this cell: start the stack with "
    "`fras up --compose twin`, or leave the section out"
)


class TaskRefused(FrasError):
    """A trial that can't be started or aborted; the text says why."""


def startable(
    request: TaskRequest, running: Executive | None, *, patient_is_here: bool
) -> Scenario:
    """Return the scenario of a trial that may start.

    Raises
    ------
    TaskRefused
    """
    if running is not None:
        raise TaskRefused(f"trial {running.status.trial!r} is under way: let it end first")
    if request.scenario is None or request.scenario.scene is None:
        raise TaskRefused("no resolved scenario came with the start: resolve it first")
    if request.scenario.has_patient and not patient_is_here:
        raise TaskRefused(NO_PATIENT)
    return request.scenario


def require_abortable(request: TaskRequest, running: Executive | None) -> None:
    """Refuse to abort a trial that does not run, or is ending.

    Raises
    ------
    TaskRefused
    """
    if running is None or running.status.trial != request.trial:
        now = f"{running.status.trial!r} is" if running is not None else "none is"
        raise TaskRefused(f"trial {request.trial!r} is not under way: {now}")
    if running.ending:
        raise TaskRefused(f"trial {request.trial!r} is ending already")
