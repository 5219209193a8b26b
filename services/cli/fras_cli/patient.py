"""Whether a stack has the patient that a trial asks for."""

from fras_cli.link import Link
from fras_common.errors import FrasError
from fras_common.topics import PATIENT
from fras_supervisor import Table

READY_TIMEOUT_S = 5.0


class NoPatient(FrasError):
    """A trial that has a patient, and a stack that has none."""


def require_process(table: Table) -> None:
    """Refuse a process table without one.

    Raises
    ------
    NoPatient
    """
    if PATIENT.service not in table.processes:
        raise NoPatient(
            f"the scenario has a [patient], and {table.source} no process.{PATIENT.service}: "
            "leave out --compose, or add the process as in compose/twin.toml"
        )


def require_ready(link: Link) -> None:
    """Refuse a stack that runs already, and has none that is ready.

    Raises
    ------
    NoPatient
    """
    if not link.wait_ready(PATIENT.service, READY_TIMEOUT_S):
        raise NoPatient(
            f"the scenario has a [patient], and cell {link.cell!r} at {link.connect} no process "
            f"{PATIENT.service!r} that is ready: start the stack with `fras up --compose twin`"
        )
