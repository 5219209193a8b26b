"""Situation awareness: fluents, force and visibility, from arrays alone.

The paper's Algorithms 1 and 2 (situation awareness, compute_fluents) as pure functions: no bus,
no message, no clock, no file. `Awareness` is the way in.
"""

from .awareness import Awareness, ContextView, Judgement
from .blocks import Blocks, make_blocks
from .errors import (
    AwarenessError,
    BadParameter,
    MalformedModel,
    NoBlocks,
    NoTissueNearRoi,
    TwoTicks,
    UnknownAtom,
    UnknownName,
    UnusableState,
)
from .memory import Memory
from .monitor import Monitored
from .parameters import AwarenessParameters
from .trend import Trend
from .views import (
    ACTIONS,
    ARMS,
    ActionView,
    ArmView,
    Evidence,
    Level,
    RobotView,
    TissueModel,
    TissueView,
    believed_where_seen,
)
from .visibility import ClosePoints, make_close_points

__all__ = [
    "ACTIONS",
    "ARMS",
    "ActionView",
    "ArmView",
    "Awareness",
    "AwarenessError",
    "AwarenessParameters",
    "BadParameter",
    "Blocks",
    "ClosePoints",
    "ContextView",
    "Evidence",
    "Judgement",
    "Level",
    "MalformedModel",
    "Memory",
    "Monitored",
    "NoBlocks",
    "NoTissueNearRoi",
    "RobotView",
    "TissueModel",
    "TissueView",
    "Trend",
    "TwoTicks",
    "UnknownAtom",
    "UnknownName",
    "UnusableState",
    "believed_where_seen",
    "make_blocks",
    "make_close_points",
]
