"""St Venant-Kirchhoff elasticity: its constants and its density at one point.

    E = (FᵀF - I) / 2                        Green-Lagrange strain
    W = mu E:E + (lambda / 2) (tr E)²        strain energy density
    S = 2 mu E + lambda (tr E) I             second Piola-Kirchhoff stress
    P = F S                                  first Piola-Kirchhoff stress

Source: Bonet, Wood, *Nonlinear Continuum Mechanics for Finite Element Analysis*, 2nd ed., 2008,
sections 6.3 and 6.4. The energy is a polynomial of F and finite for every F, also for det F <= 0:
nothing here guards the volume ratio, because a stretched specimen legitimately passes through zero
cross-section at stretch 1.79 (nu = 0.45) and a guard would stop the solver there.
"""
# pyright: reportUntypedFunctionDecorator=false
# Reason: numba ships no types for its decorators.

import math

from numba import njit

from fras_sim.fem.errors import BadParameter

# A symmetric tensor as the tuple (xx, yy, zz, xy, yz, xz) of its components.
Symmetric = tuple[float, float, float, float, float, float]


def lame_parameters(young_modulus_pa: float, poisson_ratio: float) -> tuple[float, float]:
    """Return the Lamé parameters (lambda, mu) of an isotropic material [Pa].

    Raises
    ------
    BadParameter
        If the modulus is not positive or Poisson's ratio lies outside (-1, 0.5); at 0.5 the
        material is incompressible and lambda infinite.
    """
    if not (math.isfinite(young_modulus_pa) and young_modulus_pa > 0.0):
        raise BadParameter("young_modulus_pa", young_modulus_pa, "a positive number of pascals")
    if not -1.0 < poisson_ratio < 0.5:
        raise BadParameter("poisson_ratio", poisson_ratio, "a number above -1 and below 0.5")
    lame_mu = young_modulus_pa / (2.0 * (1.0 + poisson_ratio))
    lame_lambda = 2.0 * lame_mu * poisson_ratio / (1.0 - 2.0 * poisson_ratio)
    return lame_lambda, lame_mu


@njit(cache=True, inline="always")
def energy_density(strain: Symmetric, lame_lambda: float, lame_mu: float) -> float:
    """Return W of a Green-Lagrange strain."""
    xx, yy, zz, xy, yz, xz = strain
    trace = xx + yy + zz
    square = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + xz * xz)
    return lame_mu * square + 0.5 * lame_lambda * trace * trace


@njit(cache=True, inline="always")
def second_piola(strain: Symmetric, lame_lambda: float, lame_mu: float) -> Symmetric:
    """Return S of a Green-Lagrange strain."""
    xx, yy, zz, xy, yz, xz = strain
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
