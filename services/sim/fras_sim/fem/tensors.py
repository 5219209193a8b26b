"""Tensors at one point, compiled by numba: what every material is written with.

A 3x3 tensor is the tuple of its nine components, row by row; a symmetric one the tuple (xx, yy,
zz, xy, yz, xz). Tuples stay in registers, arrays would not.
"""
# pyright: reportUntypedFunctionDecorator=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportUnknownMemberType=false
# Reason: numba ships no types; indexing inside compiled loops has none either.

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Nine = tuple[float, float, float, float, float, float, float, float, float]
Symmetric = tuple[float, float, float, float, float, float]

JACOBI_SWEEPS = 8
# Off-diagonal entries of this share of the diagonal ones (squared) are rounding.
JACOBI_TOLERANCE = 1e-24
THIRD_OF_A_TURN = 2.0 * np.pi / 3.0
# A squared cross product below this share of its factors' size has lost its direction.
CROSS_TOLERANCE = 1e-8
# Sums may be reordered and fused (for SIMD); NaN and infinity keep their meaning. The result is a
# function of the input and the compiled code, run after run.
FASTMATH = {"reassoc", "contract"}


@njit(inline="always", fastmath=FASTMATH)
def green_strain(F: Nine) -> Symmetric:
    """Return E = (FᵀF - I) / 2."""
    f00, f01, f02, f10, f11, f12, f20, f21, f22 = F
    return (
        0.5 * (f00 * f00 + f10 * f10 + f20 * f20 - 1.0),
        0.5 * (f01 * f01 + f11 * f11 + f21 * f21 - 1.0),
        0.5 * (f02 * f02 + f12 * f12 + f22 * f22 - 1.0),
        0.5 * (f00 * f01 + f10 * f11 + f20 * f21),
        0.5 * (f01 * f02 + f11 * f12 + f21 * f22),
        0.5 * (f00 * f02 + f10 * f12 + f20 * f22),
    )


@njit(inline="always", fastmath=FASTMATH)
def lagging(E: Symmetric, before: Floats, share: float) -> Symmetric:
    """Return E - share * before, `before` (6,) a strain as an array."""
    xx, yy, zz, xy, yz, xz = E
    return (
        xx - share * before[0],
        yy - share * before[1],
        zz - share * before[2],
        xy - share * before[3],
        yz - share * before[4],
        xz - share * before[5],
    )


@njit(inline="always", fastmath=FASTMATH)
def determinant(F: Nine) -> float:
    """Return det F."""
    f00, f01, f02, f10, f11, f12, f20, f21, f22 = F
    return (
        f00 * (f11 * f22 - f12 * f21)
        - f01 * (f10 * f22 - f12 * f20)
        + f02 * (f10 * f21 - f11 * f20)
    )


@njit(inline="always", fastmath=FASTMATH)
def inverse_transposed(F: Nine, J: float) -> Nine:
    """Return F⁻ᵀ, J = det F."""
    f00, f01, f02, f10, f11, f12, f20, f21, f22 = F
    s = 1.0 / J
    return (
        s * (f11 * f22 - f12 * f21),
        s * (f12 * f20 - f10 * f22),
        s * (f10 * f21 - f11 * f20),
        s * (f02 * f21 - f01 * f22),
        s * (f00 * f22 - f02 * f20),
        s * (f01 * f20 - f00 * f21),
        s * (f01 * f12 - f02 * f11),
        s * (f02 * f10 - f00 * f12),
        s * (f00 * f11 - f01 * f10),
    )


@njit(inline="always", fastmath=FASTMATH)
def times_symmetric(F: Nine, S: Symmetric) -> Nine:
    """Return F S."""
    f00, f01, f02, f10, f11, f12, f20, f21, f22 = F
    s00, s11, s22, s01, s12, s02 = S
    return (
        f00 * s00 + f01 * s01 + f02 * s02,
        f00 * s01 + f01 * s11 + f02 * s12,
        f00 * s02 + f01 * s12 + f02 * s22,
        f10 * s00 + f11 * s01 + f12 * s02,
        f10 * s01 + f11 * s11 + f12 * s12,
        f10 * s02 + f11 * s12 + f12 * s22,
        f20 * s00 + f21 * s01 + f22 * s02,
        f20 * s01 + f21 * s11 + f22 * s12,
        f20 * s02 + f21 * s12 + f22 * s22,
    )


@njit
def diagonalise(matrix: Floats, vectors: Floats) -> None:
    """Turn a symmetric 3x3 `matrix` into its eigenvalues, in place, on the diagonal.

    `vectors` takes the eigenvectors as columns. Cyclic Jacobi rotations (Golub, Van Loan, *Matrix
    Computations*, section 8.5).
    """
    for i in range(3):
        for j in range(3):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(JACOBI_SWEEPS):
        off = matrix[0, 1] ** 2 + matrix[0, 2] ** 2 + matrix[1, 2] ** 2
        size = matrix[0, 0] ** 2 + matrix[1, 1] ** 2 + matrix[2, 2] ** 2
        if off <= JACOBI_TOLERANCE * size:
            break
        for p in range(2):
            for r in range(p + 1, 3):
                pivot = matrix[p, r]
                if pivot == 0.0:
                    continue
                theta = (matrix[r, r] - matrix[p, p]) / (2.0 * pivot)
                t = 1.0 / (abs(theta) + np.sqrt(theta * theta + 1.0))
                if theta < 0.0:
                    t = -t
                c = 1.0 / np.sqrt(t * t + 1.0)
                s = t * c
                for k in range(3):
                    left, right = matrix[k, p], matrix[k, r]
                    matrix[k, p] = c * left - s * right
                    matrix[k, r] = s * left + c * right
                for k in range(3):
                    left, right = matrix[p, k], matrix[r, k]
                    matrix[p, k] = c * left - s * right
                    matrix[r, k] = s * left + c * right
                for k in range(3):
                    left, right = vectors[k, p], vectors[k, r]
                    vectors[k, p] = c * left - s * right
                    vectors[k, r] = s * left + c * right


@njit(fastmath=FASTMATH)
def positive_part(S: Symmetric, matrix: Floats, vectors: Floats) -> Symmetric:
    """Return the positive semidefinite part of S; the (3, 3) arrays are scratch.

    Definite matrices, told by their leading minors, need no eigenvalues. In the others one
    eigenvalue w has a sign of its own: the positive part is ``w v vᵀ`` or ``S - w v vᵀ``. It comes
    from the trigonometric formula (Smith, *Comm. ACM* 4, 1961), its vector from a cross product,
    its last digits from Rayleigh's quotient; where that is ill conditioned, Jacobi rotations do it.
    """
    s00, s11, s22, s01, s12, s02 = S
    minor = s00 * s11 - s01 * s01
    det = s22 * minor + s02 * (s01 * s12 - s11 * s02) - s12 * (s00 * s12 - s01 * s02)
    if minor > 0.0:
        if s00 > 0.0 and det > 0.0:
            return S
        if s00 < 0.0 and det < 0.0:
            return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    mean = (s00 + s11 + s22) / 3.0
    d00, d11, d22 = s00 - mean, s11 - mean, s22 - mean
    size = np.sqrt(
        (d00 * d00 + d11 * d11 + d22 * d22 + 2.0 * (s01 * s01 + s12 * s12 + s02 * s02)) / 6.0
    )
    if size == 0.0:
        return (max(s00, 0.0), max(s11, 0.0), max(s22, 0.0), 0.0, 0.0, 0.0)
    third = d00 * (d11 * d22 - s12 * s12) - s01 * (s01 * d22 - s12 * s02)
    third += s02 * (s01 * s12 - d11 * s02)
    angle = np.arccos(min(max(third / (2.0 * size * size * size), -1.0), 1.0)) / 3.0
    one_is_positive = det > 0.0
    w = mean + 2.0 * size * np.cos(angle if one_is_positive else angle + THIRD_OF_A_TURN)
    # Two rows of S - w I span a plane across which v lies; the best conditioned pair is taken.
    a00, a11, a22 = s00 - w, s11 - w, s22 - w
    x, y, z = s01 * s12 - s02 * a11, s02 * s01 - a00 * s12, a00 * a11 - s01 * s01
    best = x * x + y * y + z * z
    bx, by, bz = s01 * a22 - s02 * s12, s02 * s02 - a00 * a22, a00 * s12 - s01 * s02
    square = bx * bx + by * by + bz * bz
    if square > best:
        x, y, z, best = bx, by, bz, square
    bx, by, bz = a11 * a22 - s12 * s12, s12 * s02 - s01 * a22, s01 * s12 - a11 * s02
    square = bx * bx + by * by + bz * bz
    if square > best:
        x, y, z, best = bx, by, bz, square
    if best < CROSS_TOLERANCE * size * size * size * size:
        return _positive_part_by_rotations(S, matrix, vectors)
    sx, sy, sz = (
        s00 * x + s01 * y + s02 * z,
        s01 * x + s11 * y + s12 * z,
        s02 * x + s12 * y + s22 * z,
    )
    scale = (x * sx + y * sy + z * sz) / (best * best)
    if one_is_positive:
        c = max(scale, 0.0)
        return (c * x * x, c * y * y, c * z * z, c * x * y, c * y * z, c * x * z)
    c = min(scale, 0.0)
    return (
        s00 - c * x * x,
        s11 - c * y * y,
        s22 - c * z * z,
        s01 - c * x * y,
        s12 - c * y * z,
        s02 - c * x * z,
    )


@njit
def _positive_part_by_rotations(S: Symmetric, matrix: Floats, vectors: Floats) -> Symmetric:
    s00, s11, s22, s01, s12, s02 = S
    matrix[0, 0], matrix[1, 1], matrix[2, 2] = s00, s11, s22
    matrix[0, 1], matrix[1, 2], matrix[0, 2] = s01, s12, s02
    matrix[1, 0], matrix[2, 1], matrix[2, 0] = s01, s12, s02
    diagonalise(matrix, vectors)
    w0, w1, w2 = max(matrix[0, 0], 0.0), max(matrix[1, 1], 0.0), max(matrix[2, 2], 0.0)
    v = vectors
    return (
        w0 * v[0, 0] * v[0, 0] + w1 * v[0, 1] * v[0, 1] + w2 * v[0, 2] * v[0, 2],
        w0 * v[1, 0] * v[1, 0] + w1 * v[1, 1] * v[1, 1] + w2 * v[1, 2] * v[1, 2],
        w0 * v[2, 0] * v[2, 0] + w1 * v[2, 1] * v[2, 1] + w2 * v[2, 2] * v[2, 2],
        w0 * v[0, 0] * v[1, 0] + w1 * v[0, 1] * v[1, 1] + w2 * v[0, 2] * v[1, 2],
        w0 * v[1, 0] * v[2, 0] + w1 * v[1, 1] * v[2, 1] + w2 * v[1, 2] * v[2, 2],
        w0 * v[0, 0] * v[2, 0] + w1 * v[0, 1] * v[2, 1] + w2 * v[0, 2] * v[2, 2],
    )
