"""Whether the arms of a supervised trial moved only while somebody looked at the page."""

from bisect import bisect_left, bisect_right

from fras_audit.comparison import Tally
from fras_audit.recorded import Recorded
from fras_common.messages import RobotState
from fras_common.topics import PRESENCE, ROBOT_STATE
from fras_motion.holds import PAGE
from fras_motion.page_watch import PRESENCE_TIMEOUT_S

# Motion judges by when it hears; the log has when the page spoke, by the page's clock, and may lack
# some of its words, which nobody repeats.
SLACK_S = 1.0


def audit_supervision(recorded: Recorded) -> list[Tally]:
    """Hold each motion against who was said to look at a page then; nothing if nobody had to."""
    if not recorded.scenario.run.supervised:
        return []
    states = recorded.of(ROBOT_STATE)
    eyes = sorted(one.stamp_ns for one in recorded.of(PRESENCE) if one.viewers > 0)
    tally = Tally("motion", "supervision", len(states))
    reach_ns = int((PRESENCE_TIMEOUT_S + SLACK_S) * 1e9)
    before: RobotState | None = None
    for state in states:
        moves = before is not None and _moves(before, state)
        first = bisect_left(eyes, state.stamp_ns - reach_ns)
        seen = first < bisect_right(eyes, state.stamp_ns + int(SLACK_S * 1e9))
        told = "moves" if moves else "stands"
        derived = told if seen else "stands"
        tally.compare(f"tick {state.tick}", told, derived, state.seq)
        before = state
    return [tally]


def _moves(before: RobotState, state: RobotState) -> bool:
    """Whether an arm that is not being stopped for want of a page was told to go elsewhere."""
    return PAGE not in state.holds and any(
        arm.setpoint_joints != before.arms[name].setpoint_joints
        for name, arm in state.arms.items()
        if name in before.arms
    )
