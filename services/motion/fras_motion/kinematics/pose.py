"""A pose: where a frame is and how it is turned, as plain numbers."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

__all__ = ["Matrix", "Pose", "Quaternion", "Vector3", "matrix", "quaternion"]

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Pose:
    """A frame in another frame; the name of the variable says which in which (`tip_in_world`).

    Parameters
    ----------
    position_m : tuple of float, length 3
        Origin of the frame [m].
    quaternion_xyzw : tuple of float, length 4
        Unit quaternion of its rotation, scalar last.
    """

    position_m: Vector3
    quaternion_xyzw: Quaternion


def matrix(quaternion_xyzw: Quaternion) -> Matrix:
    """Convert a unit quaternion to a rotation matrix.

    Parameters
    ----------
    quaternion_xyzw : tuple of float, length 4
        Unit quaternion, scalar last.

    Returns
    -------
    ndarray, shape (3, 3), float64
        Columns are the turned frame's axes.
    """
    x, y, z, w = quaternion_xyzw
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion(rotation: Matrix) -> Quaternion:
    """Convert a rotation matrix to a unit quaternion (Shepperd's method).

    The component of largest magnitude is made positive. For a tool that points down the scalar
    part is near zero, so the usual rule (scalar part positive) would flip the sign with the
    rounding.

    Parameters
    ----------
    rotation : ndarray, shape (3, 3), float64
        A rotation matrix.

    Returns
    -------
    tuple of float, length 4
        Unit quaternion, scalar last.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation.tolist()
    fours = (1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz)
    largest = max(range(4), key=fours.__getitem__)
    rows = (
        (fours[0], xy + yx, xz + zx, zy - yz),
        (xy + yx, fours[1], yz + zy, xz - zx),
        (xz + zx, yz + zy, fours[2], yx - xy),
        (zy - yz, xz - zx, yx - xy, fours[3]),
    )
    x, y, z, w = rows[largest]
    norm = sqrt(x * x + y * y + z * z + w * w)
    return (x / norm, y / norm, z / norm, w / norm)
