"""Whether motion held exactly when it was told to."""

from bisect import bisect_right
from collections.abc import Sequence

from fras_audit.comparison import Tally
from fras_audit.recorded import Recorded
from fras_common.messages import Holds, RobotState
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
    before: RobotState | None = None
    for state in states:
        shown = _of_others(state)
        in_force = _in_force(said, stamps, before, state)
        derived = shown if shown in in_force else in_force[-1]
        tally.compare(f"tick {state.tick}", shown, derived, state.seq)
        before = state
    return tally


def _in_force(
    said: Sequence[Holds], stamps: Sequence[int], before: RobotState | None, state: RobotState
) -> list[dict[str, str]]:
    """Return what was held since the state before; the last is what is held now."""
    first = bisect_right(stamps, before.stamp_ns) if before is not None else 0
    since = [one.holds for one in said[max(0, first - 1) : bisect_right(stamps, state.stamp_ns)]]
    if first > 0:
        return since
    # Nothing had been told before that state: what it showed goes on until something is.
    return [_of_others(before if before is not None else state), *since]


def _of_others(state: RobotState) -> dict[str, str]:
    """Leave out motion's own hold, with which it brings a cancelled action to rest."""
    return {holder: reason for holder, reason in state.holds.items() if holder != CANCELLER}
