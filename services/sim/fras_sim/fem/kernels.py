"""The loops over nodes and rows, compiled by numba; those over elements: `element_kernels`."""
# pyright: reportUntypedFunctionDecorator=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportUnknownMemberType=false
# Reason: numba ships no types; indexing inside compiled loops has none either.

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fras_sim.fem.tensors import FASTMATH

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


@njit("f8(f8[:,::1], f8[:,::1], f8[::1], f8[::1], f8[::1], f8[:,::1])", cache=True)
def nodal_terms(
    x: Floats, target: Floats, inertia: Floats, bed: Floats, weight: Floats, force: Floats
) -> float:
    """Add inertia, bed and weight to `force` (n_nodes, 3) and return their energy [J].

    Inertia: inertia/2 |x - target|² of each node; bed: bed/2 min(z, 0)², both in N/m; weight [N]
    times z.
    """
    energy = 0.0
    for node in range(x.shape[0]):
        for i in range(3):
            offset = x[node, i] - target[node, i]
            energy += 0.5 * inertia[node] * offset * offset
            force[node, i] += inertia[node] * offset
        depth = min(x[node, 2], 0.0)
        energy += 0.5 * bed[node] * depth * depth + weight[node] * x[node, 2]
        force[node, 2] += bed[node] * depth + weight[node]
    return energy


@njit("f8(f8[::1])", cache=True)
def largest(values: Floats) -> float:
    """Return the largest magnitude: 0 of none, infinity if one is not a number."""
    result = 0.0
    for k in range(len(values)):
        magnitude = abs(values[k])
        # Written so that what is not a number is kept: every comparison with it is false.
        if not magnitude <= result:
            result = magnitude if magnitude > result else np.inf
    return result


@njit("f8[::1](i4[::1], i4[::1], f8[::1], f8[::1])", cache=True)
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


_PAIRS = "i8, f4[:, ::1], f4[:, ::1], f8[::1], f8[::1], f8[::1]"
Singles = NDArray[np.float32]


@njit(f"void({_PAIRS})", cache=True, fastmath=FASTMATH)
def lbfgs_before(
    added: int, steps: Singles, changes: Singles, scales: Floats, weights: Floats, q: Floats
) -> None:
    """Take the newest to the oldest pair off `q` and keep the weights (`lbfgs`)."""
    history = len(scales)
    for k in range(added - 1, max(added - history, 0) - 1, -1):
        step, change = steps[k % history], changes[k % history]
        product = 0.0
        for i in range(len(q)):
            product += step[i] * q[i]
        weight = scales[k % history] * product
        weights[k % history] = weight
        for i in range(len(q)):
            q[i] -= weight * change[i]


@njit(f"void({_PAIRS})", cache=True, fastmath=FASTMATH)
def lbfgs_after(
    added: int, steps: Singles, changes: Singles, scales: Floats, weights: Floats, r: Floats
) -> None:
    """Put the oldest to the newest pair back onto `r`."""
    history = len(scales)
    for k in range(max(added - history, 0), added):
        step, change = steps[k % history], changes[k % history]
        product = 0.0
        for i in range(len(r)):
            product += change[i] * r[i]
        share = weights[k % history] - scales[k % history] * product
        for i in range(len(r)):
            r[i] += share * step[i]
