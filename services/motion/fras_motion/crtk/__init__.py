"""The arms under the keys of CRTK: state machine, commands from outside, what is published."""

from .direct import DirectControl, shown
from .errors import CommandRefused
from .state_machine import COMMANDS, STATES, ArmStatus, follow, way_back

__all__ = [
    "COMMANDS",
    "STATES",
    "ArmStatus",
    "CommandRefused",
    "DirectControl",
    "follow",
    "shown",
    "way_back",
]
