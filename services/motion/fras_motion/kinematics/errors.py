"""What the kinematics refuse."""

from __future__ import annotations

from fras_common.errors import FrasError

__all__ = ["Unreachable"]


class Unreachable(FrasError):
    """A pose needs a joint beyond its limits.

    Parameters
    ----------
    joint : str
        The first joint, from the base, that is out of bounds.
    value : float
        What it would have to be [rad; m for the insertion].
    lower, upper : float
        What it may be [rad or m].
    """

    joint: str
    value: float
    lower: float
    upper: float

    def __init__(self, joint: str, value: float, lower: float, upper: float) -> None:
        super().__init__(
            f"unreachable: {joint} would have to be {value:.4f}, allowed is "
            f"{lower:.4f} .. {upper:.4f}; choose a nearer target or place the arm's base anew",
            joint=joint,
            value=value,
            lower=lower,
            upper=upper,
        )
