"""Memory: what no single state shows, the fluent `max_height(A)` and the trend of the force.

The memory is an immutable value, small enough to be restored from the last verdict and the
robot's state of that tick.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

from .parameters import AwarenessParameters
from .trend import AT_REST, Trend
from .views import FINAL_PHASES, ActionView, Level, RobotView


@dataclass(frozen=True, slots=True)
class Memory:
    """What situation awareness knows from the ticks before.

    Parameters
    ----------
    max_height : frozenset of str
        Arms that have pulled as far as they may.
    running : (str, str) or None
        Name and arm of the action that the last tick left unfinished; tells the first tick of a
        move or release from its later ones.
    trend : Trend
        Of the force.
    """

    max_height: frozenset[str] = frozenset()
    running: tuple[str, str] | None = None
    trend: Trend = AT_REST

    @classmethod
    def restored(cls, max_height: Iterable[str], action: ActionView | None, trend: Trend) -> Self:
        """Return the memory after tick k, from verdict(k) and the action of robot/state(k)."""
        return cls(frozenset(max_height), _unfinished(action), trend)


def remember(
    memory: Memory,
    parameters: AwarenessParameters,
    robot: RobotView,
    level: Level,
    *,
    visible: bool,
    trend: Trend,
) -> Memory:
    """Return the memory after one tick.

    Parameters
    ----------
    memory : Memory
        After the tick before.
    parameters : AwarenessParameters
        For what counts as a closed gripper.
    robot : RobotView
        The arms and the action of this tick.
    level : {"ok", "soft", "hard", "invalid"}
        The level of this tick.
    visible : bool
        Whether the ROI is visible in this tick.
    trend : Trend
        Of the force, after this tick.

    Returns
    -------
    Memory

    Notes
    -----
    In this order, A being the arm of the action:

    1. the first tick of a move or release of A clears max_height(A);
    2. a soft crossing (a pull, by definition), or a hard one in any action but a release while
       A's gripper is closed, sets it;
    3. a pull of A that is done, so has reached its height, sets it if the ROI is not visible.

    An invalid tick sets nothing; it still counts as a tick of its action.
    """
    action = robot.action
    if action is None:
        return Memory(memory.max_height, None, trend)
    max_height = memory.max_height
    if action.name in ("move", "release") and memory.running != (action.name, action.arm):
        max_height = max_height - {action.arm}
    crossed = level == "soft" or (
        level == "hard"
        and action.name != "release"
        and robot.arms[action.arm].jaw_rad < parameters.closed_jaw_rad
    )
    pulled_out = (
        level != "invalid" and action.name == "pull" and action.phase == "done" and not visible
    )
    if crossed or pulled_out:
        max_height = max_height | {action.arm}
    return Memory(max_height, _unfinished(action), trend)


def _unfinished(action: ActionView | None) -> tuple[str, str] | None:
    if action is None or action.phase in FINAL_PHASES:
        return None
    return action.name, action.arm
