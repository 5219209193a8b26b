"""The loops over elements, compiled by numba for each element and material.

All arrays are C-contiguous float64 unless said otherwise; ``e`` counts elements, ``q`` quadrature
points, ``a`` and ``b`` the nodes of an element, ``i`` and ``j`` space. Moduli come premultiplied
with the quadrature weights: ``bulk[e, q] = lambda * w``, ``shear[e, q] = mu * w``; ``before``
(e, q, 6) is the Green-Lagrange strain at the start of the step, for the viscosity (`materials`).
"""
# pyright: reportUntypedFunctionDecorator=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportUnknownMemberType=false
# Reason: numba ships no types; indexing inside compiled loops has none either.

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from types import ModuleType

import numpy as np
from numba import njit
from numba import types as nb
from numpy.typing import NDArray

from fras_sim.fem import tensors
from fras_sim.fem.materials import material_module
from fras_sim.fem.tensors import FASTMATH, Nine, determinant, green_strain

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_FLOATS = [nb.Array(nb.float64, n, "C") for n in range(5)]
_INTS = [nb.Array(nb.int32, n, "C") for n in range(4)]
# x, elements, gradients, bulk, shear, before, ratio: what each kernel knows of the body.
_BODY = (_FLOATS[2], _INTS[2], _FLOATS[4], _FLOATS[2], _FLOATS[2], _FLOATS[3], nb.float64)
_ENERGY = nb.float64(*_BODY, _FLOATS[2])
_HESSIAN = nb.void(*_BODY, nb.boolean, _INTS[3], _FLOATS[1])
_STRAINS = nb.int64(_FLOATS[2], _INTS[2], _FLOATS[4], _FLOATS[3], _INTS[1])


@dataclass(frozen=True, eq=False)
class ElementKernels:
    """Compiled loops; see `element_kernels` for what each does."""

    energy_gradient: Callable[..., float]
    hessian: Callable[..., None]
    strains: Callable[..., int]


@cache
def element_kernels(n_nodes: int, material: str) -> ElementKernels:
    """Compile, or load from numba's cache, the kernels of one element and material.

    Parameters
    ----------
    n_nodes : int
        Nodes of an element: a constant of the compiled code, which unrolls its loops.
    material : str
        Name of a material (`materials.MATERIALS`).

    Notes
    -----
    Signatures are explicit: nothing is compiled when a kernel is called. numba keys its cache by
    source file, bytecode and closure: the closures here hold nothing but numbers and a module,
    which pickle to the same bytes in every process, and a fingerprint of the material's code,
    which lies in a file that numba would not look at.
    """
    module = material_module(material)
    stamp = _fingerprint(module, tensors)
    return ElementKernels(
        _energy_gradient(n_nodes, module, stamp),
        _hessian(n_nodes, module, stamp),
        _strains(n_nodes, _fingerprint(tensors)),
    )


def _fingerprint(*modules: ModuleType) -> int:
    """Return a number that changes with the bytecode of the modules' compiled functions."""
    digest = hashlib.sha256()
    for module in modules:
        for name, value in sorted(vars(module).items()):
            code = getattr(getattr(value, "py_func", None), "__code__", None)
            if code is not None:
                constants = [c for c in code.co_consts if isinstance(c, int | float | str)]
                digest.update(f"{name}{code.co_code!r}{constants}{code.co_names}".encode())
    return int.from_bytes(digest.digest()[:7], "big")


@njit(inline="always", fastmath=FASTMATH)
def _deformation_gradient(corner: Floats, gradient: Floats, n_nodes: int) -> Nine:
    """F_ij = sum_a x_ai dN_a/dX_j of one point; corner (3, a), gradient (3, a)."""
    f00 = f01 = f02 = f10 = f11 = f12 = f20 = f21 = f22 = 0.0
    for a in range(n_nodes):
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


def _energy_gradient(n_nodes: int, material: ModuleType, stamp: int) -> Callable[..., float]:
    @njit(_ENERGY, cache=True, fastmath=FASTMATH)
    def energy_gradient(
        x: Floats,
        elements: Ints,
        gradients: Floats,
        bulk: Floats,
        shear: Floats,
        before: Floats,
        ratio: float,
        force: Floats,
    ) -> float:
        """Add dW/dx to `force` (n_nodes, 3) [N] and return W [J], possibly infinite."""
        _ = stamp
        energy = 0.0
        corner = np.empty((3, n_nodes))
        local = np.empty((3, n_nodes))
        for e in range(elements.shape[0]):
            for a in range(n_nodes):
                node = elements[e, a]
                for i in range(3):
                    corner[i, a] = x[node, i]
                    local[i, a] = 0.0
            for q in range(gradients.shape[1]):
                gradient = gradients[e, q]
                F = _deformation_gradient(corner, gradient, n_nodes)
                W, P = material.energy_stress(F, before[e, q], bulk[e, q], shear[e, q], ratio)
                energy += W
                p00, p01, p02, p10, p11, p12, p20, p21, p22 = P
                for a in range(n_nodes):
                    gx, gy, gz = gradient[0, a], gradient[1, a], gradient[2, a]
                    local[0, a] += p00 * gx + p01 * gy + p02 * gz
                    local[1, a] += p10 * gx + p11 * gy + p12 * gz
                    local[2, a] += p20 * gx + p21 * gy + p22 * gz
            for a in range(n_nodes):
                node = elements[e, a]
                for i in range(3):
                    force[node, i] += local[i, a]
        return energy

    return energy_gradient


def _hessian(n_nodes: int, material: ModuleType, stamp: int) -> Callable[..., None]:
    @njit(_HESSIAN, cache=True, fastmath=FASTMATH)
    def hessian(
        x: Floats,
        elements: Ints,
        gradients: Floats,
        bulk: Floats,
        shear: Floats,
        before: Floats,
        ratio: float,
        project: bool,
        scatter: Ints,
        values: Floats,
    ) -> None:
        """Add d²W/dx² to `values`; `scatter` (n_elements, n_pairs, 9) says where each entry goes.

        The node pairs of an element are (a, b), a <= b, row by row; the 9 entries of their block,
        ``sum_q dN_a/dX_J (dP_iJ/dF_kL) dN_b/dX_L``, are (i, k), row by row. `project` makes the
        matrix positive semidefinite (`materials`).
        """
        _ = stamp
        corner = np.empty((3, n_nodes))
        # Rows of 9 n entries, (i, k, b): long enough to be vectorised.
        block = np.empty((n_nodes, 9 * n_nodes))
        half = np.empty((3, 9 * n_nodes))
        tangent = np.empty((9, 9))
        scratch = np.empty((3, 3, 3))
        for e in range(elements.shape[0]):
            for a in range(n_nodes):
                for i in range(3):
                    corner[i, a] = x[elements[e, a], i]
            block[:] = 0.0
            for q in range(gradients.shape[1]):
                n = gradients[e, q]
                F = _deformation_gradient(corner, n, n_nodes)
                tangent[:] = 0.0
                material.add_tangent(
                    F, before[e, q], bulk[e, q], shear[e, q], ratio, project, tangent, scratch
                )
                for i in range(3):
                    for j in range(3):
                        for k in range(3):
                            t0 = tangent[3 * i + j, 3 * k]
                            t1 = tangent[3 * i + j, 3 * k + 1]
                            t2 = tangent[3 * i + j, 3 * k + 2]
                            c = (3 * i + k) * n_nodes
                            for b in range(n_nodes):
                                half[j, c + b] = t0 * n[0, b] + t1 * n[1, b] + t2 * n[2, b]
                for a in range(n_nodes):
                    n0, n1, n2 = n[0, a], n[1, a], n[2, a]
                    for c in range(9 * n_nodes):
                        block[a, c] += n0 * half[0, c] + n1 * half[1, c] + n2 * half[2, c]
            pair = 0
            for a in range(n_nodes):
                for b in range(a, n_nodes):
                    for c in range(9):
                        values[scatter[e, pair, c]] += block[a, c * n_nodes + b]
                    pair += 1

    return hessian


def _strains(n_nodes: int, stamp: int) -> Callable[..., int]:
    @njit(_STRAINS, cache=True, fastmath=FASTMATH)
    def strains(
        x: Floats, elements: Ints, gradients: Floats, strain: Floats, inverted: Ints
    ) -> int:
        """Write the Green-Lagrange strain (e, q, 6) and the elements with det F <= 0 somewhere.

        `inverted` (n_elements,) takes 1 for such an element, 0 for the others; returned is their
        sum.
        """
        _ = stamp
        corner = np.empty((3, n_nodes))
        count = 0
        for e in range(elements.shape[0]):
            for a in range(n_nodes):
                for i in range(3):
                    corner[i, a] = x[elements[e, a], i]
            inverted[e] = 0
            for q in range(gradients.shape[1]):
                F = _deformation_gradient(corner, gradients[e, q], n_nodes)
                value = green_strain(F)
                for c in range(6):
                    strain[e, q, c] = value[c]
                if determinant(F) <= 0.0:
                    inverted[e] = 1
            count += inverted[e]
        return count

    return strains
