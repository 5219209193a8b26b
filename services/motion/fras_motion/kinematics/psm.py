"""The da Vinci PSM (Classic) with a Large Needle Driver 400006, as numbers.

Modified Denavit-Hartenberg: ``T = Rx(alpha) Tx(a) Rz(theta) Tz(d)``; the joint's value adds to
``theta`` (revolute) or to ``d`` (prismatic). The base frame is the remote centre of motion (RCM).
The numbers are those of jhu-dvrk/sawIntuitiveResearchKit (``PSM.json``,
``LARGE_NEEDLE_DRIVER_400006.json``).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, radians

import numpy as np
from numpy.typing import NDArray

__all__ = ["JAW_LOWER_RAD", "JAW_UPPER_RAD", "JOINTS", "JOINT_NAMES", "TIP_ROTATION", "DhJoint"]


@dataclass(frozen=True)
class DhJoint:
    """One row of the table, SI units (a prismatic joint's offset, limits and rates in metres).

    Parameters
    ----------
    name : str
        Name of the joint, as refusals give it.
    prismatic : bool
        Whether the value adds to ``d`` instead of ``theta``.
    alpha_rad, a_m, d_m : float
        The constant parameters of the row.
    offset : float
        What is added to the joint's value [rad or m].
    lower, upper : float
        Limits of the joint's value [rad or m].
    speed, acceleration : float
        Limits of planned motion [rad/s or m/s, and per s].
    """

    name: str
    prismatic: bool
    alpha_rad: float
    a_m: float
    d_m: float
    offset: float
    lower: float
    upper: float
    speed: float
    acceleration: float


# Cartesian control needs the shaft's end at least 45 mm past the RCM: the mechanism's own lower
# limit of 0 would let the wrist fold back into the cannula.
_INSERTION_LOWER_M = 0.0586

_WRIST_SPEED = radians(1080.0)
_WRIST_ACCELERATION = radians(720.0)

JOINTS: tuple[DhJoint, ...] = (
    DhJoint("yaw", False, pi / 2, 0.0, 0.0, pi / 2, -1.588, 1.588, radians(90.0), radians(90.0)),
    DhJoint(
        "pitch", False, -pi / 2, 0.0, 0.0, -pi / 2, -0.925025, 0.925025, radians(90), radians(90)
    ),
    DhJoint("insertion", True, pi / 2, 0.0, 0.0, -0.4318, _INSERTION_LOWER_M, 0.240, 0.2, 0.2),
    DhJoint(
        "roll", False, 0.0, 0.0, 0.4162, 0.0, -4.53786, 4.53786, _WRIST_SPEED, _WRIST_ACCELERATION
    ),
    DhJoint(
        "wrist_pitch",
        False,
        -pi / 2,
        0.0,
        0.0,
        -pi / 2,
        -1.39626,
        1.39626,
        _WRIST_SPEED,
        _WRIST_ACCELERATION,
    ),
    DhJoint(
        "wrist_yaw",
        False,
        -pi / 2,
        0.0091,
        0.0,
        -pi / 2,
        -1.39626,
        1.39626,
        _WRIST_SPEED,
        _WRIST_ACCELERATION,
    ),
)
JOINT_NAMES: tuple[str, ...] = tuple(joint.name for joint in JOINTS)

JAW_LOWER_RAD = radians(-40.0)
JAW_UPPER_RAD = radians(80.0)

#: Rotation from the last joint's frame to the tool's tip (z along the jaws), no translation.
TIP_ROTATION: NDArray[np.float64] = np.array([[0, -1, 0], [0, 0, 1], [-1, 0, 0]], dtype=np.float64)
TIP_ROTATION.setflags(write=False)
