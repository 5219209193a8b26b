"""Safety: named gates on every setpoint, and the reactions to the force verdict."""

from .admission import Check, Situation
from .capsules import JAW_RADIUS_M, SHAFT_RADIUS_M, box_distance_m, instrument_distance_m
from .errors import GateRefused
from .force import LEVELS, Reaction, force_relieved, required_reaction
from .gates import check_workspace, joint_accelerations
from .safeguards import CHECKS, GATES, SAFEGUARDS, Safeguard
from .step import Bounds, Box, Gate, Step

__all__ = [
    "CHECKS",
    "GATES",
    "JAW_RADIUS_M",
    "LEVELS",
    "SAFEGUARDS",
    "SHAFT_RADIUS_M",
    "Bounds",
    "Box",
    "Check",
    "Gate",
    "GateRefused",
    "Reaction",
    "Safeguard",
    "Situation",
    "Step",
    "box_distance_m",
    "check_workspace",
    "force_relieved",
    "instrument_distance_m",
    "joint_accelerations",
    "required_reaction",
]
