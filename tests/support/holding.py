"""Who holds the arms, as motion tells it to whoever holds them too."""

from fras_common.messages import HoldRequest, HoldState, ResumeRequest
from fras_common.topics import HOLD, RESUME
from support.shells import ShellBench

PROBE = "probe"


def holders(bench: ShellBench) -> dict[str, str]:
    """Holders and their reasons; nobody's hold is another one afterwards."""
    state: HoldState = bench.answer(HOLD, HoldRequest(holder=PROBE, reason="asks"))
    bench.answer(RESUME, ResumeRequest(holder=PROBE, by=PROBE))
    return {holder: why for holder, why in state.holds.items() if holder != PROBE}
