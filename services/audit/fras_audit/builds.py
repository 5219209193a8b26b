"""Whether a service computed on a build like ours, and what numbers may differ by if not."""

from fras_audit.comparison import Tolerance
from fras_audit.recorded import Recorded
from fras_common.service.build import build_of_this_process

# Each of these services computes each message from recorded inputs, or along paths given in closed
# form: only the last digits of sums and of sines are another library's, and nothing adds up.
ROUNDING = Tolerance(1e-9)


def other_build(recorded: Recorded, service: str) -> str:
    """Say how a service's build is another one than ours; empty if it is the same."""
    theirs = recorded.facts(service).get("build", "")
    if theirs == build_of_this_process():
        return ""
    return f"recorded on another build ({theirs or 'the log does not say which'})"


def rounding(recorded: Recorded, service: str) -> Tolerance | None:
    """Return what to allow for: nothing on the same build."""
    return ROUNDING if other_build(recorded, service) else None
