"""Whether motion held exactly when it was told to."""

from bisect import bisect_right

from fras_audit.comparison import Tally
from fras_audit.recorded import Recorded
from fras_common.messages import RobotState
from fras_common.topics import HOLDS, ROBOT_STATE
from fras_motion.trial import CANCELLER


def audit_holds(recorded: Recorded) -> Tally:
    """Hold what each robot state shows against what motion itself had told before.

    Motion tells each change on `motion/holds` before it answers whoever made it, and shows it in
    its next state. Both are stamped by one clock. A hold of before the log is open stands in the
    first state only, and stays until one of these messages says otherwise.
    """
    states = recorded.of(ROBOT_STATE)
    said = recorded.of(HOLDS)
    tally = Tally("motion", "holds shown", len(states))
    stamps = [one.stamp_ns for one in said]
    # What was held before anything was told stands in the first state.
    at_first = _of_others(states[0]) if states else {}
    before_ns = 0
    for state in states:
        shown = _of_others(state)
        # One told while a state was on its way may show in it, or in the next one.
        earliest, latest = bisect_right(stamps, before_ns), bisect_right(stamps, state.stamp_ns)
        since = [one.holds for one in said[max(0, earliest - 1) : latest]]
        in_force = since if earliest > 0 else [at_first, *since]
        derived = shown if shown in in_force else in_force[-1]
        tally.compare(f"tick {state.tick}", shown, derived, state.seq)
        before_ns = state.stamp_ns
    return tally


def _of_others(state: RobotState) -> dict[str, str]:
    """Leave out motion's own hold, with which it brings a cancelled action to rest."""
    return {holder: reason for holder, reason in state.holds.items() if holder != CANCELLER}
