"""The PSM in plain numpy, from its published table: what motion is held against.

It shares nothing with `fras_motion`. The numbers are those of jhu-dvrk/sawIntuitiveResearchKit
(`PSM.json`, `LARGE_NEEDLE_DRIVER_400006.json`), typed anew; the chain is multiplied joint by
joint. `tests/motion/test_psm_kinematics.py` and `test_arm_placement.py` hold both together.
"""

from math import pi

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

NAMES = ("yaw", "pitch", "insertion", "roll", "wrist_pitch", "wrist_yaw")
INSERTION = 2

# Modified Denavit-Hartenberg, T = Rx(alpha) Tx(a) Rz(theta) Tz(d): alpha, a, theta and d at zero.
TABLE: tuple[tuple[float, float, float, float], ...] = (
    (pi / 2, 0.0, pi / 2, 0.0),
    (-pi / 2, 0.0, -pi / 2, 0.0),
    (pi / 2, 0.0, 0.0, -0.4318),
    (0.0, 0.0, 0.0, 0.4162),
    (-pi / 2, 0.0, -pi / 2, 0.0),
    (-pi / 2, 0.0091, -pi / 2, 0.0),
)
TO_TIP: Floats = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])

# The mechanism inserts from 0; with the tool in Cartesian control the shaft's end has to be 45 mm
# past the remote centre.
LOWER: Floats = np.array([-1.588, -0.925025, 0.0586, -4.53786, -1.39626, -1.39626])
UPPER: Floats = np.array([1.588, 0.925025, 0.240, 4.53786, 1.39626, 1.39626])
_DEGREE = pi / 180
SPEED: Floats = np.array([90 * _DEGREE, 90 * _DEGREE, 0.2, *[1080 * _DEGREE] * 3])
ACCELERATION: Floats = np.array([90 * _DEGREE, 90 * _DEGREE, 0.2, *[720 * _DEGREE] * 3])
JAW_RAD = (-40 * _DEGREE, 80 * _DEGREE)
JAW_ACCELERATION = 720 * _DEGREE

# Where the remote centres stand [m], and the turn of the bases about the world's z [rad].
BASES: dict[str, tuple[tuple[float, float, float], float]] = {
    "psm1": ((0.05, 0.0, 0.16), pi / 2),
    "psm2": ((0.05, 0.12, 0.16), -pi / 2),
}
AT_ORIGIN = ((0.0, 0.0, 0.0), 0.0)


def forward(
    joints: Floats, base: tuple[tuple[float, float, float], float] = AT_ORIGIN
) -> tuple[Floats, Floats]:
    """Forward kinematics of many postures at once.

    Parameters
    ----------
    joints : ndarray, shape (n, 6)
        Joint values [rad; m for the insertion].
    base : tuple
        Position [m] and turn about z [rad] of the arm's base, of `BASES`.

    Returns
    -------
    positions : ndarray, shape (n, 3)
        The tips in the world [m].
    rotations : ndarray, shape (n, 3, 3)
        Their rotations in the world; columns are the tips' axes.
    """
    (x, y, z), turn = base
    chain = np.broadcast_to(
        np.array(
            [
                [np.cos(turn), -np.sin(turn), 0.0, x],
                [np.sin(turn), np.cos(turn), 0.0, y],
                [0.0, 0.0, 1.0, z],
                [0.0, 0.0, 0.0, 1.0],
            ]
        ),
        (len(joints), 4, 4),
    )
    for number in range(len(TABLE)):
        chain = chain @ _link(number, joints[:, number])
    return chain[:, :3, 3], chain[:, :3, :3] @ TO_TIP


def _link(number: int, values: Floats) -> Floats:
    alpha, a, theta, d = TABLE[number]
    prismatic = number == INSERTION
    thetas = np.full_like(values, theta) if prismatic else theta + values
    ds = d + values if prismatic else np.full_like(values, d)
    c, s, zero = np.cos(thetas), np.sin(thetas), np.zeros_like(values)
    ca, sa = np.cos(alpha), np.sin(alpha)
    rows = (
        (c, -s, zero, zero + a),
        (ca * s, ca * c, zero - sa, -sa * ds),
        (sa * s, sa * c, zero + ca, ca * ds),
        (zero, zero, zero, zero + 1.0),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def tool_down(arm: str) -> Floats:
    """Return the rotation that an arm's tool keeps: wrist straight, shaft vertical."""
    _, rotations = forward(np.array([[0.0, 0.0, 0.1, 0.0, 0.0, 0.0]]), BASES[arm])
    return rotations[0]


def turns_rad(rotations: Floats, reference: Floats) -> Floats:
    """Angle between rotations and a reference; the chord resolves small ones, the cosine doesn't.

    |R - S|_F = 2 sqrt(2) sin(angle / 2).
    """
    chords = np.linalg.norm(rotations - reference, axis=(-2, -1)) / (2.0 * np.sqrt(2.0))
    return 2.0 * np.arcsin(np.minimum(chords, 1.0))


def rotations_of(quaternions_xyzw: Floats) -> Floats:
    """Rotation matrices of unit quaternions, scalar last; shape (n, 4) to (n, 3, 3)."""
    vector, w = quaternions_xyzw[:, :3], quaternions_xyzw[:, 3, None, None]
    x, y, z = vector.T
    zero = np.zeros_like(x)
    cross = np.stack(
        [
            np.stack([zero, -z, y], axis=-1),
            np.stack([z, zero, -x], axis=-1),
            np.stack([-y, x, zero], axis=-1),
        ],
        axis=-2,
    )
    return np.eye(3) + 2.0 * (w * cross + cross @ cross)
