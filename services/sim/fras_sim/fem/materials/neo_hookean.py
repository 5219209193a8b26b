"""Compressible neo-Hookean: resists compression without bound.

    J = det F
    W = (mu / 2) (tr FᵀF - 3) - mu ln J + (lambda / 2) (ln J)²      infinite for J <= 0
    P = mu (F - F⁻ᵀ) + lambda (ln J) F⁻ᵀ
    dP_iJ/dF_kL = mu delta_ik delta_JL + (mu - lambda ln J) G_iL G_kJ + lambda G_iJ G_kL,  G = F⁻ᵀ

Source: Bonet, Wood, *Nonlinear Continuum Mechanics for Finite Element Analysis*, 2nd ed., 2008,
section 6.4.3 (energy and stress); the tangent is their derivative, d(F⁻ᵀ) = -F⁻ᵀ dFᵀ F⁻ᵀ.

The projection is exact: with F = U diag(s) Vᵀ the tangent falls apart, over the basis u_a ⊗ v_b,
into a 3x3 matrix for the stretches (a = b), entries

    mu delta_ab + (mu - lambda ln J) / s_a² delta_ab + lambda / (s_a s_b)

and, for each pair a < b, a 2x2 matrix [[mu, q], [q, mu]] with q = (mu - lambda ln J) / (s_a s_b),
whose eigenvalues are mu + q and mu - q (Smith, de Goes, Kim, *Analytic Eigensystems for Isotropic
Distortion Energies*, ACM Trans. Graph. 38, 2019). Each takes its positive part.
"""
# pyright: reportUntypedFunctionDecorator=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportUnknownMemberType=false
# Reason: numba ships no types; indexing inside compiled loops has none either.

import numpy as np
from numba import njit

from fras_sim.fem.materials.svk import add_green_tangent, energy_density, second_piola
from fras_sim.fem.tensors import (
    FASTMATH,
    Floats,
    Nine,
    determinant,
    diagonalise,
    green_strain,
    inverse_transposed,
    lagging,
    positive_part,
    times_symmetric,
)


@njit(inline="always", fastmath=FASTMATH)
def energy_stress(
    F: Nine, before: Floats, lame_lambda: float, lame_mu: float, ratio: float
) -> tuple[float, Nine]:
    """Return W and P (see `materials`); W is infinite where J <= 0."""
    J = determinant(F)
    if J <= 0.0:
        return np.inf, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    log_J = np.log(J)
    E = green_strain(F)
    D = lagging(E, before, 1.0)
    W = (
        lame_mu * (E[0] + E[1] + E[2] - log_J)
        + 0.5 * lame_lambda * log_J * log_J
        + energy_density(D, ratio * lame_lambda, ratio * lame_mu)
    )
    G = inverse_transposed(F, J)
    viscous = times_symmetric(F, second_piola(D, ratio * lame_lambda, ratio * lame_mu))
    push = lame_lambda * log_J - lame_mu
    return W, (
        lame_mu * F[0] + push * G[0] + viscous[0],
        lame_mu * F[1] + push * G[1] + viscous[1],
        lame_mu * F[2] + push * G[2] + viscous[2],
        lame_mu * F[3] + push * G[3] + viscous[3],
        lame_mu * F[4] + push * G[4] + viscous[4],
        lame_mu * F[5] + push * G[5] + viscous[5],
        lame_mu * F[6] + push * G[6] + viscous[6],
        lame_mu * F[7] + push * G[7] + viscous[7],
        lame_mu * F[8] + push * G[8] + viscous[8],
    )


@njit(inline="always", fastmath=FASTMATH)
def add_tangent(
    F: Nine,
    before: Floats,
    lame_lambda: float,
    lame_mu: float,
    ratio: float,
    project: bool,
    tangent: Floats,
    scratch: Floats,
) -> None:
    """Add dP/dF (see `materials`)."""
    if ratio > 0.0:
        D = lagging(green_strain(F), before, 1.0)
        add_green_tangent(F, D, ratio * lame_lambda, ratio * lame_mu, project, tangent, scratch)
    if project:
        _add_projected(F, lame_lambda, lame_mu, tangent, scratch)
    else:
        _add_exact(F, lame_lambda, lame_mu, tangent)


@njit(fastmath=FASTMATH)
def _add_exact(F: Nine, lame_lambda: float, lame_mu: float, tangent: Floats) -> None:
    J = determinant(F)
    G = np.array(inverse_transposed(F, J)).reshape(3, 3)
    cross = lame_mu - lame_lambda * np.log(J)
    for i in range(3):
        for k in range(3):
            for j in range(3):
                for l in range(3):  # noqa: E741
                    tangent[3 * i + j, 3 * k + l] += (
                        cross * G[i, l] * G[k, j] + lame_lambda * G[i, j] * G[k, l]
                    )
    for row in range(9):
        tangent[row, row] += lame_mu


@njit(fastmath=FASTMATH)
def _add_projected(
    F: Nine, lame_lambda: float, lame_mu: float, tangent: Floats, scratch: Floats
) -> None:
    right, V, U = scratch[0], scratch[1], scratch[2]
    f = np.array(F).reshape(3, 3)
    for i in range(3):
        for j in range(3):
            right[i, j] = f[0, i] * f[0, j] + f[1, i] * f[1, j] + f[2, i] * f[2, j]
    diagonalise(right, V)
    s = np.empty(3)
    for a in range(3):
        s[a] = np.sqrt(right[a, a])
        for i in range(3):
            U[i, a] = (f[i, 0] * V[0, a] + f[i, 1] * V[1, a] + f[i, 2] * V[2, a]) / s[a]
    cross = lame_mu - lame_lambda * np.log(s[0] * s[1] * s[2])
    h = (
        lame_mu + (cross + lame_lambda) / (s[0] * s[0]),
        lame_mu + (cross + lame_lambda) / (s[1] * s[1]),
        lame_mu + (cross + lame_lambda) / (s[2] * s[2]),
        lame_lambda / (s[0] * s[1]),
        lame_lambda / (s[1] * s[2]),
        lame_lambda / (s[0] * s[2]),
    )
    h = positive_part(h, np.empty((3, 3)), np.empty((3, 3)))
    # coefficient[a, b, c, d] of (u_a ⊗ v_b) (u_c ⊗ v_d), as a 9x9 matrix.
    coefficient = np.zeros((9, 9))
    coefficient[0, 0], coefficient[4, 4], coefficient[8, 8] = h[0], h[1], h[2]
    coefficient[0, 4] = coefficient[4, 0] = h[3]
    coefficient[4, 8] = coefficient[8, 4] = h[4]
    coefficient[0, 8] = coefficient[8, 0] = h[5]
    for a in range(2):
        for b in range(a + 1, 3):
            q = cross / (s[a] * s[b])
            plus, minus = max(lame_mu + q, 0.0), max(lame_mu - q, 0.0)
            here, there = 3 * a + b, 3 * b + a
            coefficient[here, here] = coefficient[there, there] = 0.5 * (plus + minus)
            coefficient[here, there] = coefficient[there, here] = 0.5 * (plus - minus)
    basis = np.empty((9, 9))
    for a in range(3):
        for b in range(3):
            for i in range(3):
                for j in range(3):
                    basis[3 * a + b, 3 * i + j] = U[i, a] * V[j, b]
    turned = np.zeros((9, 9))
    for row in range(9):
        for column in range(9):
            if coefficient[row, column] != 0.0:
                for k in range(9):
                    turned[row, k] += coefficient[row, column] * basis[column, k]
    for row in range(9):
        for j in range(9):
            for k in range(9):
                tangent[j, k] += basis[row, j] * turned[row, k]
