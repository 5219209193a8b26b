"""An order of elimination that keeps a factor narrow."""

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.assembly import SparsityPattern

Ints = NDArray[np.int64]


def narrow_order(pattern: SparsityPattern) -> Ints:
    """Return the rows of a pattern in the order in which to eliminate them.

    Parameters
    ----------
    pattern : SparsityPattern

    Returns
    -------
    ndarray, shape (pattern.n,), int64
        The rows as they are, if that costs no more, else level by level along the body's longest
        extent (`level_order`).

    Notes
    -----
    A box numbered slice by slice is as narrow as it gets; a mesh from a file may come in any order.
    """
    as_given = np.arange(pattern.n)
    by_level = _rows_of_nodes(pattern)
    return (
        as_given
        if envelope_cost(pattern, as_given) <= envelope_cost(pattern, by_level)
        else by_level
    )


def envelope(n: int, columns: Ints, rows: Ints) -> Ints:
    """Return for each of n columns of the factor the end of its rows (exclusive), never decreasing.

    `columns` and `rows`, rows >= columns, are those of the entries of the lower triangle.
    """
    ends = np.arange(1, n + 1)
    np.maximum.at(ends, columns, rows + 1)
    return np.maximum.accumulate(ends)


def envelope_cost(pattern: SparsityPattern, order: Ints) -> int:
    """Return the floating-point operations of a Cholesky factorisation inside the envelope.

    Notes
    -----
    The sum over the columns of their squared height (George, Liu, *Computer Solution of Large
    Sparse Positive Definite Systems*, 1981, section 4.2).
    """
    place = inverse(order)
    one, other = place[pattern.rows], place[pattern.indices]
    ends = envelope(pattern.n, np.minimum(one, other), np.maximum(one, other))
    return int(((ends - np.arange(pattern.n)) ** 2).sum())


def inverse(order: Ints) -> Ints:
    """Return the place of each row in an order."""
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return place


def level_order(n_vertices: int, first: Ints, second: Ints) -> Ints:
    """Return the vertices of a graph, level by level from one far end to the other.

    Parameters
    ----------
    n_vertices : int
    first, second : ndarray of int
        Vertices at the two ends of each edge.

    Notes
    -----
    Cuthill-McKee starts from a vertex: on a hexahedral mesh, where diagonal neighbours are
    neighbours, a corner's levels are hooks up to twice as wide as a slice. Here the levels start
    from a whole side: the vertices farthest from one from which nothing is farther (found by the
    sweeps to and fro of Gibbs, Poole, Stockmeyer, *SIAM J. Numer. Anal.* 13, 1976). The side is
    ordered from one of its own ends; in each level vertices follow the first of their neighbours.
    """
    graph = _Graph(n_vertices, first, second)
    order: list[Ints] = []
    is_left = np.ones(n_vertices, dtype=bool)
    while is_left.any():
        somewhere = np.flatnonzero(is_left)[:1]
        levels = graph.levels(somewhere)
        while len(further := graph.levels(levels[-1][:1])) > len(levels):
            levels = further
        side = np.sort(further[-1])
        along = graph.within(side)
        end = along.levels(np.zeros(1, dtype=np.int64))[-1][:1]
        reached = np.concatenate(along.levels(end))
        missed = np.setdiff1d(np.arange(len(side)), reached)
        part = np.concatenate(graph.levels(side[np.concatenate([reached, missed])]))
        is_left[part] = False
        order.append(part)
    return np.concatenate(order)


class _Graph:
    """Neighbours of each vertex, in compressed rows."""

    def __init__(self, n_vertices: int, first: Ints, second: Ints) -> None:
        self._n = n_vertices
        self._first, self._second = first, second
        edges = np.unique(
            np.concatenate([first * n_vertices + second, second * n_vertices + first])
        )
        self._neighbours = edges % n_vertices
        self._start = np.searchsorted(edges, np.arange(n_vertices + 1) * n_vertices)

    def within(self, vertices: Ints) -> "_Graph":
        """Return the graph of the edges among some vertices, numbered in their order."""
        number = np.full(self._n, -1)
        number[vertices] = np.arange(len(vertices))
        first, second = number[self._first], number[self._second]
        among = (first >= 0) & (second >= 0)
        return _Graph(len(vertices), first[among], second[among])

    def levels(self, start: Ints) -> list[Ints]:
        """Return the vertices in reach by their distance from `start`, each after its parent."""
        is_new = np.ones(self._n, dtype=bool)
        is_new[start] = False
        levels = [start]
        while True:
            begin = self._start[levels[-1]]
            lengths = self._start[levels[-1] + 1] - begin
            offsets = np.repeat(begin - np.cumsum(lengths) + lengths, lengths)
            neighbours = self._neighbours[offsets + np.arange(lengths.sum())]
            neighbours = neighbours[is_new[neighbours]]
            _, earliest = np.unique(neighbours, return_index=True)
            if len(earliest) == 0:
                return levels
            levels.append(neighbours[np.sort(earliest)])
            is_new[levels[-1]] = False


def _rows_of_nodes(pattern: SparsityPattern) -> Ints:
    """Order the nodes, then put the rows of each node one after the other."""
    nodes, node_of_row = np.unique(pattern.free // 3, return_inverse=True)
    order = level_order(len(nodes), node_of_row[pattern.rows], node_of_row[pattern.indices])
    place = inverse(order)
    return np.argsort(place[node_of_row], kind="stable")
