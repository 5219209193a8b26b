"""The arms under the keys of CRTK: state machine, commands from outside, what is published."""

from .direct import DirectControl, shown
from .errors import CommandRefused
from .state_machine import COMMANDS, STATES, ArmStatus, follow

__all__ = ["COMMANDS", "STATES", "ArmStatus", "CommandRefused", "DirectControl", "follow", "shown"]
