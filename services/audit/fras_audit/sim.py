"""The model's tissue again."""

from fras_audit.comparison import Tally
from fras_audit.progress import Progress
from fras_audit.recorded import Recorded
from fras_audit.tissue import audit_tissue
from fras_common.topics import TWIN


def audit(recorded: Recorded, progress: Progress) -> list[Tally]:
    """Derive it; see `audit_tissue`."""
    return audit_tissue(recorded, progress, TWIN)
