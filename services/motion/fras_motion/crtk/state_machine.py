"""CRTK's state machine of an arm: which command leads from which state to which."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from .errors import CommandRefused

__all__ = ["COMMANDS", "STATES", "ArmStatus", "follow", "way_back"]

STATES: Final = ("DISABLED", "ENABLED", "PAUSED", "FAULT")

# Command -> state before -> state after; what is not here is not legal. `home` and `unhome` change
# no state: the arms' encoders are absolute, so homing moves nothing.
COMMANDS: Final[Mapping[str, Mapping[str, str]]] = {
    "enable": {"DISABLED": "ENABLED", "FAULT": "ENABLED"},
    "disable": dict.fromkeys(STATES, "DISABLED"),
    "pause": {"ENABLED": "PAUSED"},
    "resume": {"PAUSED": "ENABLED"},
    "home": {"ENABLED": "ENABLED"},
    "unhome": {"ENABLED": "ENABLED", "DISABLED": "DISABLED"},
}


@dataclass(frozen=True)
class ArmStatus:
    """Where an arm's state machine stands.

    Parameters
    ----------
    state : str
        One of `STATES`.
    is_homed : bool
        Whether the arm knows where it is.
    """

    state: str = "ENABLED"
    is_homed: bool = True

    @property
    def may_move(self) -> bool:
        """Whether the arm follows motion commands."""
        return self.state == "ENABLED" and self.is_homed


def follow(arm: str, status: ArmStatus, command: str) -> ArmStatus:
    """Return the status after a command.

    Parameters
    ----------
    arm : str
        Whose it is, for the refusal.
    status : ArmStatus
        Before the command.
    command : str
        One of `COMMANDS`.

    Raises
    ------
    CommandRefused
        The command is not legal in that state; names those in which it is.
    """
    legal = COMMANDS[command]
    if status.state not in legal:
        raise CommandRefused(
            arm,
            "state_command",
            "wrong_state",
            f"{command!r} is for {' or '.join(sorted(legal))}, the arm is {status.state}",
            asked=command,
            state=status.state,
        )
    homed = {"home": True, "unhome": False}.get(command, status.is_homed)
    return replace(status, state=legal[status.state], is_homed=homed)


def way_back(status: ArmStatus) -> tuple[str, ...]:
    """Commands that let an arm move again; none if it may.

    Parameters
    ----------
    status : ArmStatus
        Where it stands.
    """
    enabling = {"ENABLED": (), "PAUSED": ("resume",)}.get(status.state, ("enable",))
    return (*enabling, *(() if status.is_homed else ("home",)))
