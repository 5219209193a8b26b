"""The patient's tissue again, where the trial has one besides its model."""

from fras_audit.comparison import Tally
from fras_audit.progress import Progress
from fras_audit.recorded import Recorded
from fras_audit.tissue import audit_tissue
from fras_common.topics import PATIENT


def audit(recorded: Recorded, progress: Progress) -> list[Tally]:
    """Derive it; see `audit_tissue`. Nothing if there is none, and nothing is told of one."""
    told = recorded.of(PATIENT.model) or recorded.of(PATIENT.state)
    if not (recorded.scenario.has_patient or told or recorded.of(PATIENT.checkpoint)):
        return []
    return audit_tissue(recorded, progress, PATIENT)
