"""Which entries the Hessian has, and where an element's go."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FIXED = -1


@dataclass(frozen=True, eq=False)
class SparsityPattern:
    """Upper triangle, by rows, of the Hessian over the degrees of freedom that are not fixed.

    Parameters
    ----------
    indptr, indices : ndarray, int32
        Compressed rows; columns ascend, the first entry of a row is its diagonal.
    rows : ndarray, shape (n_entries,), int32
        Row of each entry.
    free : ndarray, shape (n,), int64
        For each row, its place in a flattened (n_nodes, 3) array.
    row_of : ndarray, shape (n_nodes, 3), int32
        For each degree of freedom, its row, or -1 if its node is fixed.
    scatter : ndarray, shape (n_elements, n_pairs, 9), int32
        Target of each entry of an element's Hessian; what belongs nowhere goes to ``n_entries``.
    nodes_m : ndarray, shape (n_nodes, 3) [m]
        Where the nodes are at rest: what is near is eliminated together.
    """

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    rows: NDArray[np.int32]
    free: NDArray[np.int64]
    row_of: NDArray[np.int32]
    scatter: NDArray[np.int32]
    nodes_m: NDArray[np.float64]

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(self.free)

    @property
    def n_entries(self) -> int:
        """Number of stored entries."""
        return len(self.indices)

    @property
    def diagonal(self) -> NDArray[np.int32]:
        """Place of each row's diagonal among the entries."""
        return self.indptr[:-1]


def sparsity_pattern(
    elements: NDArray[np.int32], nodes_m: NDArray[np.float64], fixed_nodes: NDArray[np.int32]
) -> SparsityPattern:
    """Return the pattern of the Hessian with the fixed nodes eliminated."""
    is_free = np.ones(nodes_m.shape, dtype=bool)
    is_free[fixed_nodes] = False
    free = np.flatnonzero(is_free)
    n = len(free)
    row_of = np.full(nodes_m.shape, FIXED, dtype=np.int32)
    row_of[is_free] = np.arange(n, dtype=np.int32)

    first, second = np.triu_indices(elements.shape[1])
    rows_a = np.repeat(row_of[elements[:, first]], 3, axis=2).astype(np.int64)
    rows_b = np.tile(row_of[elements[:, second]], (1, 1, 3)).astype(np.int64)
    low, high = np.minimum(rows_a, rows_b), np.maximum(rows_a, rows_b)
    # The block of a node with itself is symmetric: its lower half would be counted twice.
    lower_half = (first == second)[:, None] & np.tril(np.ones((3, 3), dtype=bool), -1).ravel()
    stored = (low != FIXED) & ~lower_half

    keys, place = np.unique(low[stored] * n + high[stored], return_inverse=True)
    scatter = np.full(low.shape, len(keys), dtype=np.int32)
    scatter[stored] = place
    rows = (keys // n).astype(np.int32)
    indptr = np.searchsorted(rows, np.arange(n + 1)).astype(np.int32)
    columns = (keys % n).astype(np.int32)
    return SparsityPattern(indptr, columns, rows, free, row_of, scatter, nodes_m)


class IdentityRows:
    """Makes some rows and columns of a matrix those of the identity.

    This prescribes unknowns without a new pattern.

    Parameters
    ----------
    pattern : SparsityPattern
    rows : ndarray of int32
    """

    def __init__(self, pattern: SparsityPattern, rows: NDArray[np.int32]) -> None:
        is_prescribed = np.zeros(pattern.n, dtype=bool)
        is_prescribed[rows] = True
        self._zeros = np.flatnonzero(is_prescribed[pattern.rows] | is_prescribed[pattern.indices])
        self._ones = pattern.diagonal[rows]

    def put_into(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Change the entries of a matrix in place, and return them."""
        values[self._zeros] = 0.0
        values[self._ones] = 1.0
        return values
