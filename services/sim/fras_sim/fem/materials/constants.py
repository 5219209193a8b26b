"""The constants of an isotropic solid."""

import math

from fras_sim.fem.errors import BadParameter


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
