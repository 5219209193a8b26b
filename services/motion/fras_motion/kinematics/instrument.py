"""The instrument as a bent line, for whoever asks how near something comes to it."""

from __future__ import annotations

from dataclasses import dataclass

from .pose import Vector3

__all__ = ["Instrument"]


@dataclass(frozen=True)
class Instrument:
    """The axis of an instrument inside the patient.

    Parameters
    ----------
    remote_centre_m : tuple of float, length 3
        Where the shaft enters, world frame [m].
    wrist_m : tuple of float, length 3
        Where the shaft ends: the wrist's centre [m].
    tip_m : tuple of float, length 3
        Tip of the jaws [m].
    """

    remote_centre_m: Vector3
    wrist_m: Vector3
    tip_m: Vector3
