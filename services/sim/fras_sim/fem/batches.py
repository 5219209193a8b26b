"""Elements in batches as wide as the loops over them (`element_kernels`)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.element import Quadrature

# Fewer, and LLVM does not vectorise; more, and a batch's numbers leave the fastest cache.
LANES = 16
# Elements whose gradients differ by less than this share are the same element, moved.
CONGRUENT = 1e-12


@dataclass(frozen=True, eq=False)
class Batches:
    """The elements of a mesh, sixteen to a batch; the last axis is the lane.

    What fills up the last batch repeats the last element, with no weight.

    Parameters
    ----------
    elements : ndarray, shape (n_batches, nodes per element, 16), int32
    gradients : ndarray, shape (n_sets, n_points, 3, nodes per element, 16), float64 [1/m]
    by_element : ndarray, shape (n_sets, 16, n_points, 3, nodes per element)
        The same numbers, those of an element next to each other.
    set_of : ndarray, shape (n_batches,), int32
        Which of the sets of gradients is a batch's: congruent batches share one, so that a box
        needs a few kilobytes of them and not megabytes.
    shear_weights, bulk_weights : ndarray, shape (n_batches, n_points, 16), float64 [m³]
    """

    elements: NDArray[np.int32]
    gradients: NDArray[np.float64]
    by_element: NDArray[np.float64]
    set_of: NDArray[np.int32]
    shear_weights: NDArray[np.float64]
    bulk_weights: NDArray[np.float64]


def make_batches(elements: NDArray[np.int32], points: Quadrature) -> Batches:
    """Put elements and their quadrature into batches."""
    gradients = _by_lane(points.gradients)
    scaled = np.rint(gradients / (CONGRUENT * np.abs(gradients).max()))
    _, first, set_of = np.unique(
        scaled.reshape(len(scaled), -1), axis=0, return_index=True, return_inverse=True
    )
    shear, bulk = _by_lane(points.shear_weights), _by_lane(points.bulk_weights)
    idle = len(shear) * LANES - len(elements)
    for weights in (shear, bulk):
        weights[-1, :, LANES - idle :] = 0.0
    return Batches(
        _by_lane(elements.astype(np.int32)),
        np.ascontiguousarray(gradients[first]),
        np.ascontiguousarray(np.moveaxis(gradients[first], -1, 1)),
        set_of.ravel().astype(np.int32),
        shear,
        bulk,
    )


def _by_lane(values: NDArray[Any]) -> NDArray[Any]:
    """Return (n_elements, ...) as (n_batches, ..., 16), the last element repeated."""
    idle = -len(values) % LANES
    filled = np.concatenate([values, np.repeat(values[-1:], idle, axis=0)])
    return np.ascontiguousarray(np.moveaxis(filled.reshape(-1, LANES, *values.shape[1:]), 1, -1))
