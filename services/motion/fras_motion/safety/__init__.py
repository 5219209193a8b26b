"""Safety: named gates on every setpoint, and the reactions to the force verdict."""

from .capsules import JAW_RADIUS_M, SHAFT_RADIUS_M, box_distance_m, instrument_distance_m
from .errors import GateRefused
from .force import LEVELS, Reaction, force_relieved, required_reaction
from .gates import GATES, check_workspace, joint_accelerations
from .step import Bounds, Box, Gate, Step

__all__ = [
    "GATES",
    "JAW_RADIUS_M",
    "LEVELS",
    "SHAFT_RADIUS_M",
    "Bounds",
    "Box",
    "Gate",
    "GateRefused",
    "Reaction",
    "Step",
    "box_distance_m",
    "check_workspace",
    "force_relieved",
    "instrument_distance_m",
    "joint_accelerations",
    "required_reaction",
]
