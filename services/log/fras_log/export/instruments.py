"""Shape of an instrument from what an arm says of itself: its tip, its joints, its jaw."""

from math import cos, sin
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fras_common.messages import ArmState, Quaternion, Vec3
from fras_log.export.facts import Instrument

# Of the da Vinci PSM (Classic) with a Large Needle Driver, from its table of modified
# Denavit-Hartenberg parameters: wrist pitch to wrist yaw, and what the insertion adds to.
WRIST_M: Final = 0.0091
INSERTION_OFFSET_M: Final = 0.4162 - 0.4318
# What the simulator grasps is at the tip, so the blades are drawn to end there, not to begin.
BLADE_M: Final = 0.008
FloatArray = NDArray[np.float64]


def instrument(arm: ArmState) -> Instrument:
    """Draw an arm.

    Notes
    -----
    No placement of the arms is recorded. The joints tell all the same where the shaft is, seen
    from the tip: back from it over the wrist's two joints, then along the shaft by the insertion
    to the remote centre. The tip's x axis is the hinge of the jaws, its z axis points out of them.
    """
    tip = np.array(arm.tip_in_world.position_m)
    turned = rotation(arm.tip_in_world.quaternion_xyzw)
    insertion, _, pitch, yaw = arm.joints[2:]
    # Seen from the tip: from it to the wrist's first joint, and on to the remote centre.
    to_wrist = np.array([0.0, sin(yaw), -cos(yaw)])
    along_shaft = cos(pitch) * to_wrist - sin(pitch) * np.array([1.0, 0.0, 0.0])
    wrist = WRIST_M * to_wrist
    centre = wrist + (insertion + INSERTION_OFFSET_M) * along_shaft
    half_rad = max(arm.jaw_rad, 0.0) / 2.0
    hinge = np.array([0.0, 0.0, -BLADE_M])
    ends = [
        hinge + BLADE_M * np.array([0.0, side * sin(half_rad), cos(half_rad)])
        for side in (-1.0, 1.0)
    ]
    return Instrument(
        tip_m=arm.tip_in_world.position_m,
        tip_xyzw=arm.tip_in_world.quaternion_xyzw,
        jaw_rad=arm.jaw_rad,
        blades_m=(_vec(tip + turned @ ends[0]), _vec(tip + turned @ ends[1])),
        hinge_m=_vec(tip + turned @ hinge),
        wrist_m=_vec(tip + turned @ wrist),
        remote_centre_m=_vec(tip + turned @ centre),
    )


def rotation(quaternion_xyzw: Quaternion) -> FloatArray:
    """Return the rotation matrix of a unit quaternion."""
    x, y, z, w = quaternion_xyzw
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _vec(values: FloatArray) -> Vec3:
    x, y, z = values.tolist()
    return (x, y, z)
