"""What a gate says when it refuses."""

from __future__ import annotations

from fras_common.errors import FrasError

__all__ = ["GateRefused"]


class GateRefused(FrasError):
    """A setpoint that must not be sent.

    Parameters
    ----------
    gate : str
        Name of the gate.
    quantity : str
        What was out of bounds, with its unit.
    value : float
        What it would have been.
    lower, upper : float
        What it may be.
    """

    gate: str
    quantity: str
    value: float
    lower: float
    upper: float

    def __init__(self, gate: str, quantity: str, value: float, lower: float, upper: float) -> None:
        super().__init__(
            f"gate {gate}: {quantity} would be {value:.6g}, allowed is {lower:.6g} .. {upper:.6g}; "
            "the setpoint was not sent",
            gate=gate,
            quantity=quantity,
            value=value,
            lower=lower,
            upper=upper,
        )
