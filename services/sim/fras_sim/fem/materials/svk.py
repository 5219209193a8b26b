"""St Venant-Kirchhoff: the linear law between Green-Lagrange strain and second Piola stress.

    E = (FᵀF - I) / 2                        Green-Lagrange strain
    W = mu E:E + (lambda / 2) (tr E)²        strain energy density
    S = 2 mu E + lambda (tr E) I             second Piola-Kirchhoff stress
    P = F S                                  first Piola-Kirchhoff stress
    dP_iJ/dF_kL = delta_ik S_JL + mu [(F Fᵀ)_ik delta_JL + F_iL F_kJ] + lambda F_iJ F_kL

Source: Bonet, Wood, *Nonlinear Continuum Mechanics for Finite Element Analysis*, 2nd ed., 2008,
sections 6.3 and 6.4. The energy is a polynomial of F and finite for every F, also for det F <= 0:
nothing here guards the volume ratio, because a stretched specimen legitimately passes through zero
cross-section at stretch 1.79 (nu = 0.45) and a guard would stop the solver there.

The second and third term of the tangent are positive semidefinite. The projection replaces S in
the first, the geometric stiffness, by its positive part, a bound from above that costs one 3x3
eigenproblem instead of one 9x9.

Viscosity needs no terms of its own: ``W(E) + c W(E - E_n)`` equals ``(1 + c) W(E - c/(1+c) E_n)``
up to a constant, a stiffer solid whose stress-free strain lags behind.
"""
# pyright: reportUntypedFunctionDecorator=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportUnknownMemberType=false
# Reason: numba ships no types; indexing inside compiled loops has none either.

from numba import njit

from fras_sim.fem.tensors import (
    FASTMATH,
    Floats,
    Nine,
    Symmetric,
    green_strain,
    lagging,
    positive_part,
    times_symmetric,
)


@njit(inline="always", fastmath=FASTMATH)
def energy_density(E: Symmetric, lame_lambda: float, lame_mu: float) -> float:
    """Return W of a Green-Lagrange strain."""
    xx, yy, zz, xy, yz, xz = E
    trace = xx + yy + zz
    square = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + xz * xz)
    return lame_mu * square + 0.5 * lame_lambda * trace * trace


@njit(inline="always", fastmath=FASTMATH)
def second_piola(E: Symmetric, lame_lambda: float, lame_mu: float) -> Symmetric:
    """Return S of a Green-Lagrange strain."""
    xx, yy, zz, xy, yz, xz = E
    pressure = lame_lambda * (xx + yy + zz)
    two_mu = 2.0 * lame_mu
    return (
        two_mu * xx + pressure,
        two_mu * yy + pressure,
        two_mu * zz + pressure,
        two_mu * xy,
        two_mu * yz,
        two_mu * xz,
    )


@njit(inline="always", fastmath=FASTMATH)
def energy_stress(
    F: Nine, before: Floats, lame_lambda: float, lame_mu: float, ratio: float
) -> tuple[float, Nine]:
    """Return W and P (see `materials`)."""
    stiffer = 1.0 + ratio
    E = lagging(green_strain(F), before, ratio / stiffer)
    S = second_piola(E, stiffer * lame_lambda, stiffer * lame_mu)
    return energy_density(E, stiffer * lame_lambda, stiffer * lame_mu), times_symmetric(F, S)


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
    stiffer = 1.0 + ratio
    E = lagging(green_strain(F), before, ratio / stiffer)
    add_green_tangent(F, E, stiffer * lame_lambda, stiffer * lame_mu, project, tangent, scratch)


@njit(fastmath=FASTMATH)
def add_green_tangent(
    F: Nine,
    E: Symmetric,
    lame_lambda: float,
    lame_mu: float,
    project: bool,
    tangent: Floats,
    scratch: Floats,
) -> None:
    """Add dP/dF of P = F S(E), E any strain that differs from that of F by a constant."""
    stress = second_piola(E, lame_lambda, lame_mu)
    if project:
        stress = positive_part(stress, scratch[0], scratch[1])
    s00, s11, s22, s01, s12, s02 = stress
    f = scratch[2]
    f[0, 0], f[0, 1], f[0, 2] = F[0], F[1], F[2]
    f[1, 0], f[1, 1], f[1, 2] = F[3], F[4], F[5]
    f[2, 0], f[2, 1], f[2, 2] = F[6], F[7], F[8]
    for i in range(3):
        for k in range(3):
            left = lame_mu * (f[i, 0] * f[k, 0] + f[i, 1] * f[k, 1] + f[i, 2] * f[k, 2])
            for J in range(3):
                for L in range(3):
                    tangent[3 * i + J, 3 * k + L] += (
                        lame_mu * f[i, L] * f[k, J] + lame_lambda * f[i, J] * f[k, L]
                    )
                tangent[3 * i + J, 3 * k + J] += left
        row = 3 * i
        tangent[row, row] += s00
        tangent[row + 1, row + 1] += s11
        tangent[row + 2, row + 2] += s22
        tangent[row, row + 1] += s01
        tangent[row + 1, row] += s01
        tangent[row + 1, row + 2] += s12
        tangent[row + 2, row + 1] += s12
        tangent[row, row + 2] += s02
        tangent[row + 2, row] += s02
