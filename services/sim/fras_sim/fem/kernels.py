"""The loops over elements, compiled by numba: energy, gradient, projected Hessian, strains.

All arrays are C-contiguous float64 unless said otherwise; ``e`` counts elements, ``q`` quadrature
points, ``a`` and ``b`` the nodes of an element, ``i`` and ``j`` space. Moduli come premultiplied
with the quadrature weights: ``bulk[e, q] = lambda * w``, ``shear[e, q] = mu * w``. Strains are
measured from ``origin`` (e, q, 6), the strain at which the point is free of stress: zero for the
elastic force, a share of the previous step's strain when there is viscosity (`dynamics`).
"""
# pyright: reportUntypedFunctionDecorator=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportUnknownMemberType=false
# Reason: numba ships no types; indexing inside compiled loops has none either.

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fras_sim.fem.material import Symmetric, energy_density, second_piola

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
# A 3x3 tensor, row by row.
Nine = tuple[float, float, float, float, float, float, float, float, float]

N_A = 8
PAIRS = 36
JACOBI_SWEEPS = 8
# Sums over the nodes of an element may be reordered and fused (for SIMD); NaN and infinity keep
# their meaning. The result is a function of the input and the compiled code, run after run.
FASTMATH = {"reassoc", "contract"}


@njit(cache=True, inline="always", fastmath=FASTMATH)
def _deformation_gradient(corner: Floats, gradient: Floats) -> Nine:
    """F_ij = sum_a x_ai dN_a/dX_j of one point; corner (3, 8), gradient (3, 8)."""
    f00 = f01 = f02 = f10 = f11 = f12 = f20 = f21 = f22 = 0.0
    for a in range(N_A):
        gx, gy, gz = gradient[0, a], gradient[1, a], gradient[2, a]
        x, y, z = corner[0, a], corner[1, a], corner[2, a]
        f00 += x * gx
        f01 += x * gy
        f02 += x * gz
        f10 += y * gx
        f11 += y * gy
        f12 += y * gz
        f20 += z * gx
        f21 += z * gy
        f22 += z * gz
    return f00, f01, f02, f10, f11, f12, f20, f21, f22


@njit(cache=True, inline="always", fastmath=FASTMATH)
def _strain(F: Nine, origin: Floats) -> Symmetric:
    """E = (FᵀF - I) / 2 - origin, as (xx, yy, zz, xy, yz, xz)."""
    f00, f01, f02, f10, f11, f12, f20, f21, f22 = F
    return (
        0.5 * (f00 * f00 + f10 * f10 + f20 * f20 - 1.0) - origin[0],
        0.5 * (f01 * f01 + f11 * f11 + f21 * f21 - 1.0) - origin[1],
        0.5 * (f02 * f02 + f12 * f12 + f22 * f22 - 1.0) - origin[2],
        0.5 * (f00 * f01 + f10 * f11 + f20 * f21) - origin[3],
        0.5 * (f01 * f02 + f11 * f12 + f21 * f22) - origin[4],
        0.5 * (f00 * f02 + f10 * f12 + f20 * f22) - origin[5],
    )


@njit(cache=True, fastmath=FASTMATH)
def energy_gradient(
    x: Floats,
    elements: Ints,
    gradients: Floats,
    bulk: Floats,
    shear: Floats,
    origin: Floats,
    force: Floats,
) -> float:
    """Add dW/dx to `force` (n_nodes, 3) [N] and return W [J]."""
    energy = 0.0
    corner = np.empty((3, N_A))
    local = np.empty((3, N_A))
    for e in range(elements.shape[0]):
        for a in range(N_A):
            node = elements[e, a]
            for i in range(3):
                corner[i, a] = x[node, i]
                local[i, a] = 0.0
        for q in range(gradients.shape[1]):
            gradient = gradients[e, q]
            F = _deformation_gradient(corner, gradient)
            strain = _strain(F, origin[e, q])
            energy += energy_density(strain, bulk[e, q], shear[e, q])
            s00, s11, s22, s01, s12, s02 = second_piola(strain, bulk[e, q], shear[e, q])
            f00, f01, f02, f10, f11, f12, f20, f21, f22 = F
            p00 = f00 * s00 + f01 * s01 + f02 * s02
            p01 = f00 * s01 + f01 * s11 + f02 * s12
            p02 = f00 * s02 + f01 * s12 + f02 * s22
            p10 = f10 * s00 + f11 * s01 + f12 * s02
            p11 = f10 * s01 + f11 * s11 + f12 * s12
            p12 = f10 * s02 + f11 * s12 + f12 * s22
            p20 = f20 * s00 + f21 * s01 + f22 * s02
            p21 = f20 * s01 + f21 * s11 + f22 * s12
            p22 = f20 * s02 + f21 * s12 + f22 * s22
            for a in range(N_A):
                gx, gy, gz = gradient[0, a], gradient[1, a], gradient[2, a]
                local[0, a] += p00 * gx + p01 * gy + p02 * gz
                local[1, a] += p10 * gx + p11 * gy + p12 * gz
                local[2, a] += p20 * gx + p21 * gy + p22 * gz
        for a in range(N_A):
            node = elements[e, a]
            for i in range(3):
                force[node, i] += local[i, a]
    return energy


@njit(cache=True, fastmath=FASTMATH)
def strains(x: Floats, elements: Ints, gradients: Floats, strain: Floats, inverted: Ints) -> int:
    """Write the Green-Lagrange strain (e, q, 6) and the elements with det F <= 0 somewhere.

    `inverted` (n_elements,) takes 1 for such an element, 0 for the others; returned is their sum.
    """
    corner = np.empty((3, N_A))
    zero = np.zeros(6)
    count = 0
    for e in range(elements.shape[0]):
        for a in range(N_A):
            for i in range(3):
                corner[i, a] = x[elements[e, a], i]
        inverted[e] = 0
        for q in range(gradients.shape[1]):
            F = _deformation_gradient(corner, gradients[e, q])
            value = _strain(F, zero)
            for c in range(6):
                strain[e, q, c] = value[c]
            f00, f01, f02, f10, f11, f12, f20, f21, f22 = F
            volume_ratio = (
                f00 * (f11 * f22 - f12 * f21)
                - f01 * (f10 * f22 - f12 * f20)
                + f02 * (f10 * f21 - f11 * f20)
            )
            if volume_ratio <= 0.0:
                inverted[e] = 1
        count += inverted[e]
    return count


@njit(cache=True)
def positive_part(matrix: Floats, vectors: Floats) -> None:
    """Replace a symmetric 3x3 `matrix` by its positive semidefinite part, in place.

    Cyclic Jacobi rotations (Golub, Van Loan, *Matrix Computations*, section 8.5); `vectors` is
    scratch of the same shape.
    """
    for i in range(3):
        for j in range(3):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(JACOBI_SWEEPS):
        off = matrix[0, 1] ** 2 + matrix[0, 2] ** 2 + matrix[1, 2] ** 2
        size = matrix[0, 0] ** 2 + matrix[1, 1] ** 2 + matrix[2, 2] ** 2
        if off <= 1e-24 * size:
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
    w0, w1, w2 = max(matrix[0, 0], 0.0), max(matrix[1, 1], 0.0), max(matrix[2, 2], 0.0)
    for i in range(3):
        for j in range(3):
            matrix[i, j] = (
                w0 * vectors[i, 0] * vectors[j, 0]
                + w1 * vectors[i, 1] * vectors[j, 1]
                + w2 * vectors[i, 2] * vectors[j, 2]
            )


@njit(cache=True, fastmath=FASTMATH)
def hessian(
    x: Floats,
    elements: Ints,
    gradients: Floats,
    bulk: Floats,
    shear: Floats,
    origin: Floats,
    project: bool,
    scatter: Ints,
    values: Floats,
) -> None:
    """Add d²W/dx² to `values`; `scatter` (n_elements, 36, 9) says where each entry goes.

    The 36 node pairs of an element are (a, b), a <= b, row by row; the 9 entries of their block
    are (i, j), row by row. With n_a = dN_a/dX the block is

        mu [(n_a . n_b) F Fᵀ + (F n_b)(F n_a)ᵀ] + lambda (F n_a)(F n_b)ᵀ + (n_a . S n_b) I

    The first two terms are positive semidefinite. `project` replaces S in the third, the
    geometric stiffness, by its positive part, which makes the whole matrix so: a bound from above
    that costs one 3x3 eigenproblem a point instead of one 24x24 an element.
    """
    corner = np.empty((3, N_A))
    moved = np.empty((3, N_A))
    stressed = np.empty((3, N_A))
    block = np.empty((PAIRS, 9))
    S = np.empty((3, 3))
    scratch = np.empty((3, 3))
    for e in range(elements.shape[0]):
        for a in range(N_A):
            for i in range(3):
                corner[i, a] = x[elements[e, a], i]
        block[:] = 0.0
        for q in range(gradients.shape[1]):
            n = gradients[e, q]
            lam, mu = bulk[e, q], shear[e, q]
            F = _deformation_gradient(corner, n)
            f00, f01, f02, f10, f11, f12, f20, f21, f22 = F
            s00, s11, s22, s01, s12, s02 = second_piola(_strain(F, origin[e, q]), lam, mu)
            S[0, 0], S[1, 1], S[2, 2] = s00, s11, s22
            S[0, 1], S[1, 2], S[0, 2] = s01, s12, s02
            S[1, 0], S[2, 1], S[2, 0] = s01, s12, s02
            if project:
                positive_part(S, scratch)
            b00 = mu * (f00 * f00 + f01 * f01 + f02 * f02)
            b11 = mu * (f10 * f10 + f11 * f11 + f12 * f12)
            b22 = mu * (f20 * f20 + f21 * f21 + f22 * f22)
            b01 = mu * (f00 * f10 + f01 * f11 + f02 * f12)
            b12 = mu * (f10 * f20 + f11 * f21 + f12 * f22)
            b02 = mu * (f00 * f20 + f01 * f21 + f02 * f22)
            for a in range(N_A):
                gx, gy, gz = n[0, a], n[1, a], n[2, a]
                moved[0, a] = f00 * gx + f01 * gy + f02 * gz
                moved[1, a] = f10 * gx + f11 * gy + f12 * gz
                moved[2, a] = f20 * gx + f21 * gy + f22 * gz
                for i in range(3):
                    stressed[i, a] = S[i, 0] * gx + S[i, 1] * gy + S[i, 2] * gz
            pair = 0
            for a in range(N_A):
                gx, gy, gz = n[0, a], n[1, a], n[2, a]
                ax, ay, az = moved[0, a], moved[1, a], moved[2, a]
                tx, ty, tz = stressed[0, a], stressed[1, a], stressed[2, a]
                for b in range(a, N_A):
                    hx, hy, hz = n[0, b], n[1, b], n[2, b]
                    bx, by, bz = moved[0, b], moved[1, b], moved[2, b]
                    dot = gx * hx + gy * hy + gz * hz
                    geometric = tx * hx + ty * hy + tz * hz
                    k = block[pair]
                    k[0] += dot * b00 + (mu + lam) * ax * bx + geometric
                    k[1] += dot * b01 + mu * bx * ay + lam * ax * by
                    k[2] += dot * b02 + mu * bx * az + lam * ax * bz
                    k[3] += dot * b01 + mu * by * ax + lam * ay * bx
                    k[4] += dot * b11 + (mu + lam) * ay * by + geometric
                    k[5] += dot * b12 + mu * by * az + lam * ay * bz
                    k[6] += dot * b02 + mu * bz * ax + lam * az * bx
                    k[7] += dot * b12 + mu * bz * ay + lam * az * by
                    k[8] += dot * b22 + (mu + lam) * az * bz + geometric
                    pair += 1
        for pair in range(PAIRS):
            for c in range(9):
                values[scatter[e, pair, c]] += block[pair, c]


@njit(cache=True)
def nodal_terms(x: Floats, target: Floats, inertia: Floats, bed: Floats, force: Floats) -> float:
    """Add inertia and bed to `force` (n_nodes, 3) and return their energy [J].

    Inertia: inertia/2 |x - target|² of each node; bed: bed/2 min(z, 0)², both in N/m.
    """
    energy = 0.0
    for node in range(x.shape[0]):
        for i in range(3):
            offset = x[node, i] - target[node, i]
            energy += 0.5 * inertia[node] * offset * offset
            force[node, i] += inertia[node] * offset
        depth = min(x[node, 2], 0.0)
        energy += 0.5 * bed[node] * depth * depth
        force[node, 2] += bed[node] * depth
    return energy


@njit(cache=True)
def symmetric_product(indptr: Ints, indices: Ints, values: Floats, vector: Floats) -> Floats:
    """Return A v for a symmetric A of which the upper triangle is stored by rows."""
    product = np.zeros_like(vector)
    for row in range(len(indptr) - 1):
        for k in range(indptr[row], indptr[row + 1]):
            column = indices[k]
            product[row] += values[k] * vector[column]
            if column != row:
                product[column] += values[k] * vector[row]
    return product
