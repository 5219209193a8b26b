"""What an arm refuses from outside."""

from __future__ import annotations

from fras_common.errors import FrasError

__all__ = ["CommandRefused"]


class CommandRefused(FrasError):
    """A command that an arm does not follow; it stays where it is.

    Parameters
    ----------
    arm : str
        Whose.
    command : str
        Name of the command, `servo_jp`.
    reason : str
        Name of the reason: trial_runs, wrong_state, not_homed, busy, held, not_unit, unreachable,
        profile, or the name of a gate.
    text : str
        What was wrong and what to do about it.
    **values
        The numbers behind it.
    """

    arm: str
    command: str
    reason: str

    def __init__(self, arm: str, command: str, reason: str, text: str, **values: object) -> None:
        super().__init__(
            f"{arm}/{command} refused ({reason}): {text}",
            **{**values, "arm": arm, "command": command, "reason": reason},
        )
        self.counted_as = reason
