"""The loops over elements, compiled by numba for each element and material.

Sixteen elements go through a loop at once, one in each lane of the processor's vectors: the last
axis of every array of the body is the lane, and ``B`` counts batches of sixteen (`batches`). ``q``
counts quadrature points, ``a`` and ``b`` the nodes of an element, ``i`` and ``j`` space. Arrays are
C-contiguous float64 unless said otherwise. Moduli come premultiplied with the quadrature weights,
``bulk[B, q, lane] = lambda * w``, ``shear[B, q, lane] = mu * w``; ``before`` (B, q, 6, lane) is the
Green-Lagrange strain at the start of the step, for the viscosity (`materials`). Batches that are
congruent share their ``gradients`` (n_sets, q, 3, a, lane): ``set_of`` (B,) says which.

What one lane of a loop writes lies in one flat ``work`` array at constant distances: only then does
the compiler see that lanes do not disturb each other, and fill the vectors.
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
from fras_sim.fem.batches import LANES
from fras_sim.fem.materials import material_module
from fras_sim.fem.tensors import FASTMATH, Nine, Symmetric, determinant, green_strain

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_FLOATS = [nb.Array(nb.float64, n, "C") for n in range(6)]
_INTS = [nb.Array(nb.int32, n, "C") for n in range(4)]
# begin, end, x, elements, gradients, set_of: what each kernel knows of the mesh ...
_MESH = (nb.int64, nb.int64, _FLOATS[2], _INTS[3], _FLOATS[5], _INTS[1])
# ... and bulk, shear, before, ratio of the material.
_BODY = (*_MESH, _FLOATS[3], _FLOATS[3], _FLOATS[4], nb.float64)
_ENERGY = nb.float64(*_BODY, _FLOATS[2])
_HESSIAN = nb.void(*_BODY, nb.boolean, _FLOATS[5], _INTS[3], _FLOATS[1])
_STRAINS = nb.void(*_MESH, _FLOATS[4], _INTS[2])


@dataclass(frozen=True, eq=False)
class ElementKernels:
    """Compiled loops over some of the batches; see `element_kernels` for what each does."""

    energy_gradient: Callable[..., float]
    hessian: Callable[..., None]
    strains: Callable[..., None]


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
def _nine(work: Floats, at: int) -> Nine:
    """Nine numbers of one lane."""
    return (
        work[at],
        work[at + LANES],
        work[at + 2 * LANES],
        work[at + 3 * LANES],
        work[at + 4 * LANES],
        work[at + 5 * LANES],
        work[at + 6 * LANES],
        work[at + 7 * LANES],
        work[at + 8 * LANES],
    )


@njit(inline="always", fastmath=FASTMATH)
def _add_deformation(
    work: Floats, F: int, corner: int, gradients: Floats, s: int, q: int, n_nodes: int
) -> None:
    """F_ij = sum_a x_ai dN_a/dX_j of one point in every lane; corner (a, 3)."""
    for k in range(9 * LANES):
        work[F + k] = 0.0
    for a in range(n_nodes):
        at = corner + 3 * a * LANES
        for lane in range(LANES):
            gx = gradients[s, q, 0, a, lane]
            gy = gradients[s, q, 1, a, lane]
            gz = gradients[s, q, 2, a, lane]
            x, y, z = work[at + lane], work[at + LANES + lane], work[at + 2 * LANES + lane]
            work[F + lane] += x * gx
            work[F + LANES + lane] += x * gy
            work[F + 2 * LANES + lane] += x * gz
            work[F + 3 * LANES + lane] += y * gx
            work[F + 4 * LANES + lane] += y * gy
            work[F + 5 * LANES + lane] += y * gz
            work[F + 6 * LANES + lane] += z * gx
            work[F + 7 * LANES + lane] += z * gy
            work[F + 8 * LANES + lane] += z * gz


@njit(inline="always")
def _gather(work: Floats, corner: int, x: Floats, elements: Ints, batch: int, n_nodes: int) -> None:
    for a in range(n_nodes):
        for lane in range(LANES):
            node = elements[batch, a, lane]
            for i in range(3):
                work[corner + (3 * a + i) * LANES + lane] = x[node, i]


@njit(inline="always", fastmath=FASTMATH)
def _before(before: Floats, batch: int, q: int, lane: int) -> Symmetric:
    return (
        before[batch, q, 0, lane],
        before[batch, q, 1, lane],
        before[batch, q, 2, lane],
        before[batch, q, 3, lane],
        before[batch, q, 4, lane],
        before[batch, q, 5, lane],
    )


def _energy_gradient(n_nodes: int, material: ModuleType, stamp: int) -> Callable[..., float]:
    CORNER = 0
    LOCAL = CORNER + 3 * n_nodes * LANES
    DEFORMATION = LOCAL + 3 * n_nodes * LANES
    STRESS = DEFORMATION + 9 * LANES
    ENERGY = STRESS + 9 * LANES
    SIZE = ENERGY + LANES

    @njit(_ENERGY, cache=True, fastmath=FASTMATH, nogil=True)
    def energy_gradient(
        begin: int,
        end: int,
        x: Floats,
        elements: Ints,
        gradients: Floats,
        set_of: Ints,
        bulk: Floats,
        shear: Floats,
        before: Floats,
        ratio: float,
        force: Floats,
    ) -> float:
        """Add dW/dx to `force` (n_nodes, 3) [N] and return W [J], possibly infinite."""
        _ = stamp
        work = np.zeros(SIZE)
        for batch in range(begin, end):
            s = set_of[batch]
            _gather(work, CORNER, x, elements, batch, n_nodes)
            for k in range(3 * n_nodes * LANES):
                work[LOCAL + k] = 0.0
            for q in range(gradients.shape[1]):
                _add_deformation(work, DEFORMATION, CORNER, gradients, s, q, n_nodes)
                for lane in range(LANES):
                    W, P = material.energy_stress(
                        _nine(work, DEFORMATION + lane),
                        _before(before, batch, q, lane),
                        bulk[batch, q, lane],
                        shear[batch, q, lane],
                        ratio,
                    )
                    work[ENERGY + lane] += W
                    work[STRESS + lane] = P[0]
                    work[STRESS + LANES + lane] = P[1]
                    work[STRESS + 2 * LANES + lane] = P[2]
                    work[STRESS + 3 * LANES + lane] = P[3]
                    work[STRESS + 4 * LANES + lane] = P[4]
                    work[STRESS + 5 * LANES + lane] = P[5]
                    work[STRESS + 6 * LANES + lane] = P[6]
                    work[STRESS + 7 * LANES + lane] = P[7]
                    work[STRESS + 8 * LANES + lane] = P[8]
                for a in range(n_nodes):
                    at = LOCAL + 3 * a * LANES
                    for lane in range(LANES):
                        gx = gradients[s, q, 0, a, lane]
                        gy = gradients[s, q, 1, a, lane]
                        gz = gradients[s, q, 2, a, lane]
                        p00, p01, p02, p10, p11, p12, p20, p21, p22 = _nine(work, STRESS + lane)
                        work[at + lane] += p00 * gx + p01 * gy + p02 * gz
                        work[at + LANES + lane] += p10 * gx + p11 * gy + p12 * gz
                        work[at + 2 * LANES + lane] += p20 * gx + p21 * gy + p22 * gz
            for a in range(n_nodes):
                for lane in range(LANES):
                    node = elements[batch, a, lane]
                    for i in range(3):
                        force[node, i] += work[LOCAL + (3 * a + i) * LANES + lane]
        energy = 0.0
        for lane in range(LANES):
            energy += work[ENERGY + lane]
        return energy

    return energy_gradient


def _hessian(n_nodes: int, material: ModuleType, stamp: int) -> Callable[..., None]:
    CORNER = 0
    DEFORMATION = CORNER + 3 * n_nodes * LANES
    SIZE = DEFORMATION + 9 * LANES
    WIDTH = 9 * n_nodes

    @njit(_HESSIAN, cache=True, fastmath=FASTMATH, nogil=True)
    def hessian(
        begin: int,
        end: int,
        x: Floats,
        elements: Ints,
        gradients: Floats,
        set_of: Ints,
        bulk: Floats,
        shear: Floats,
        before: Floats,
        ratio: float,
        project: bool,
        by_element: Floats,
        scatter: Ints,
        values: Floats,
    ) -> None:
        """Add d²W/dx² to `values`.

        `by_element` (n_sets, lane, q, 3, a) are the gradients once more. `scatter` (n_elements,
        n_pairs, 9) says where each entry goes: the node pairs of an element are (a, b), a <= b, row
        by row; the 9 entries of their block, ``sum_q dN_a/dX_J (dP_iJ/dF_kL) dN_b/dX_L``, are
        (i, k), row by row. `project` makes the matrix positive semidefinite (`materials`). Lanes go
        one by one here: what is vectorised is the row of all blocks of a node, (i, k, b).
        """
        _ = stamp
        work = np.zeros(SIZE)
        block = np.empty((n_nodes, WIDTH))
        half = np.empty((3, WIDTH))
        tangent = np.empty((9, 9))
        scratch = np.empty((3, 3, 3))
        n_points = gradients.shape[1]
        deformations = np.empty((n_points, 9, LANES))
        for batch in range(begin, end):
            s = set_of[batch]
            _gather(work, CORNER, x, elements, batch, n_nodes)
            for q in range(n_points):
                _add_deformation(work, DEFORMATION, CORNER, gradients, s, q, n_nodes)
                for c in range(9):
                    for lane in range(LANES):
                        deformations[q, c, lane] = work[DEFORMATION + c * LANES + lane]
            for lane in range(min(LANES, len(scatter) - batch * LANES)):
                block[:] = 0.0
                for q in range(n_points):
                    n = by_element[s, lane, q]
                    d = deformations[q]
                    F = (
                        d[0, lane],
                        d[1, lane],
                        d[2, lane],
                        d[3, lane],
                        d[4, lane],
                        d[5, lane],
                        d[6, lane],
                        d[7, lane],
                        d[8, lane],
                    )
                    tangent[:] = 0.0
                    material.add_tangent(
                        F,
                        _before(before, batch, q, lane),
                        bulk[batch, q, lane],
                        shear[batch, q, lane],
                        ratio,
                        project,
                        tangent,
                        scratch,
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
                        for c in range(WIDTH):
                            block[a, c] += n0 * half[0, c] + n1 * half[1, c] + n2 * half[2, c]
                pair = 0
                element = batch * LANES + lane
                for a in range(n_nodes):
                    for b in range(a, n_nodes):
                        for c in range(9):
                            values[scatter[element, pair, c]] += block[a, c * n_nodes + b]
                        pair += 1

    return hessian


def _strains(n_nodes: int, stamp: int) -> Callable[..., None]:
    CORNER = 0
    DEFORMATION = CORNER + 3 * n_nodes * LANES
    SIZE = DEFORMATION + 9 * LANES

    @njit(_STRAINS, cache=True, fastmath=FASTMATH, nogil=True)
    def strains(
        begin: int,
        end: int,
        x: Floats,
        elements: Ints,
        gradients: Floats,
        set_of: Ints,
        strain: Floats,
        inverted: Ints,
    ) -> None:
        """Write the Green-Lagrange strain (B, q, 6, lane) and where det F <= 0 at some point.

        `inverted` (B, lane) takes 1 for such an element, 0 for the others.
        """
        _ = stamp
        work = np.zeros(SIZE)
        for batch in range(begin, end):
            _gather(work, CORNER, x, elements, batch, n_nodes)
            inverted[batch] = 0
            for q in range(gradients.shape[1]):
                _add_deformation(work, DEFORMATION, CORNER, gradients, set_of[batch], q, n_nodes)
                for lane in range(LANES):
                    F = _nine(work, DEFORMATION + lane)
                    value = green_strain(F)
                    strain[batch, q, 0, lane] = value[0]
                    strain[batch, q, 1, lane] = value[1]
                    strain[batch, q, 2, lane] = value[2]
                    strain[batch, q, 3, lane] = value[3]
                    strain[batch, q, 4, lane] = value[4]
                    strain[batch, q, 5, lane] = value[5]
                    if determinant(F) <= 0.0:
                        inverted[batch, lane] = 1

    return strains
