"""What the motion controller refuses."""

from __future__ import annotations

from fras_common.errors import FrasError

__all__ = ["InvalidParameter", "NoTickWanted", "Refused", "StaleVerdict"]


class InvalidParameter(FrasError):
    """A motion parameter outside of what it may be.

    Parameters
    ----------
    name : str
        Name of the parameter.
    value : object
        What it was.
    allowed : str
        What it may be, in words.
    """

    name: str
    value: object
    allowed: str

    def __init__(self, name: str, value: object, allowed: str) -> None:
        super().__init__(
            f"motion parameter {name} = {value!r}; allowed: {allowed}; correct it in the scenario",
            name=name,
            value=value,
            allowed=allowed,
        )


class Refused(FrasError):
    """A goal that is not accepted; the arms stay where they are.

    Parameters
    ----------
    reason : str
        Name of the safeguard that refuses, see `fras_motion.safety.SAFEGUARDS`.
    text : str
        What was wrong and what to do about it.
    **values
        The numbers behind it.
    """

    reason: str

    def __init__(self, reason: str, text: str, **values: object) -> None:
        super().__init__(f"refused ({reason}): {text}", reason=reason, **values)


class StaleVerdict(FrasError):
    """A verdict on another tick than the one the arms stand at.

    Parameters
    ----------
    expected, got : int
        The tick the arms stand at, and the verdict's.
    """

    expected: int
    got: int
    counted_as = "verdict_tick"

    def __init__(self, expected: int, got: int) -> None:
        super().__init__(
            f"verdict on tick {got}, the arms stand at {expected}; only the verdict on the present "
            "tick moves them",
            expected=expected,
            got=got,
        )


class NoTickWanted(FrasError):
    """A tick was asked for while logical time stands still.

    Parameters
    ----------
    tick : int
        The tick the arms stand at.
    holders : tuple of str
        Who holds them; empty when they are idle.
    """

    tick: int
    holders: tuple[str, ...]

    def __init__(self, tick: int, holders: tuple[str, ...]) -> None:
        why = f"held by {', '.join(holders)}" if holders else "no action runs"
        super().__init__(
            f"no tick after {tick}: {why}; ask `wants_tick` first", tick=tick, holders=holders
        )
