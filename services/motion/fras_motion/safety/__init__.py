"""Safety: named gates on every setpoint, and the reactions to the force verdict."""

from .errors import GateRefused
from .force import LEVELS, Reaction, force_relieved, required_reaction
from .gates import GATES, Bounds, Gate, Step, check_workspace, joint_accelerations

__all__ = [
    "GATES",
    "LEVELS",
    "Bounds",
    "Gate",
    "GateRefused",
    "Reaction",
    "Step",
    "check_workspace",
    "force_relieved",
    "joint_accelerations",
    "required_reaction",
]
