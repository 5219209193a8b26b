"""Hyperelastic materials behind one interface.

A material is a module with two functions, compiled by numba with ``inline="always"``:

energy_stress(F, before, lame_lambda, lame_mu, ratio)
    Energy density W, and P = dW/dF as nine numbers, row by row. ``(inf, ...)`` where the material
    cannot be.
add_tangent(F, before, lame_lambda, lame_mu, ratio, project, tangent, scratch)
    Adds dP/dF to `tangent` (9, 9): row 3 i + J, column 3 k + L holds dP_iJ / dF_kL. With
    `project` its positive semidefinite part, or a positive semidefinite bound; `scratch` is
    (3, 3, 3) and may hold anything.

Both are linear in the Lamé parameters together, which come multiplied with the weight of the
quadrature point: that makes selective reduced integration a matter of two weights, and one of the
parameters may be zero. `ratio` c > 0 adds the viscosity of a Kelvin-Voigt solid, the potential
``c (mu D:D + lambda/2 (tr D)²)`` of D = E - `before`, `before` (6,) the strain when the step began.

The kernels are compiled for each pair of element and material (`kernels.element_kernels`): a new
material is a new module and its line in `MATERIALS`.
"""

from types import ModuleType
from typing import Literal

from fras_sim.fem.errors import BadParameter
from fras_sim.fem.materials import neo_hookean, svk
from fras_sim.fem.materials.constants import lame_parameters

MaterialName = Literal["svk", "neo-hookean"]
MATERIALS: dict[str, ModuleType] = {"svk": svk, "neo-hookean": neo_hookean}

__all__ = ["MATERIALS", "MaterialName", "lame_parameters", "material_module"]


def material_module(name: str) -> ModuleType:
    """Return the material of that name.

    Raises
    ------
    BadParameter
        If there is none.
    """
    if name not in MATERIALS:
        raise BadParameter("material", name, "one of " + ", ".join(MATERIALS))
    return MATERIALS[name]
