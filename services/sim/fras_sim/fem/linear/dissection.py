"""Nested dissection: cut a mesh in two, and the halves again, and eliminate the cuts last."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.pattern import SparsityPattern

# Nodes that are not cut any further (6 to 24 are within 10 % of each other).
LEAF = 12

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Front:
    """Nodes that are eliminated together, and those they reach that are eliminated later.

    Parameters
    ----------
    own, border : ndarray of int64
        Nodes, in the order of their elimination.
    children : tuple of int
        The fronts whose border begins here: whose last cut this is.
    """

    own: Ints
    border: Ints
    children: tuple[int, ...]

    @property
    def cost(self) -> float:
        """Floating-point operations of its elimination."""
        own, border = 3.0 * len(self.own), 3.0 * len(self.border)
        return own**3 / 3.0 + own**2 * border + own * border**2


def dissect(pattern: SparsityPattern) -> list[Front]:
    """Return the fronts of a pattern, children before parents.

    Notes
    -----
    A part is cut across its longest extent at its median node: the cut are the nodes of one side
    that have neighbours on the other. On a plate of n nodes the factor has O(n log n) entries, a
    band O(n^1.5) (George, *SIAM J. Numer. Anal.* 10, 1973; Heath, Raghavan, *SIAM J. Matrix Anal.
    Appl.* 16, 1995, for dissection by coordinates).
    """
    graph = Graph(pattern)
    parts = _Parts(graph, pattern.nodes_m)
    parts.cut(graph.nodes)
    return _with_borders(graph, parts.found)


class Graph:
    """The free nodes of a pattern and their neighbours, in compressed rows."""

    def __init__(self, pattern: SparsityPattern) -> None:
        n_nodes = len(pattern.row_of)
        node_of_row = pattern.free // 3
        self.nodes: Ints = np.flatnonzero(pattern.row_of[:, 0] >= 0)
        one, other = node_of_row[pattern.rows], node_of_row[pattern.indices]
        edges = np.unique(np.concatenate([one * n_nodes + other, other * n_nodes + one]))
        self._neighbours = edges % n_nodes
        self._start = np.searchsorted(edges, np.arange(n_nodes + 1) * n_nodes)

    def edges(self, nodes: Ints) -> tuple[Ints, Ints]:
        """Return the ends of all edges from some nodes, themselves included: here, there."""
        begin = self._start[nodes]
        lengths = self._start[nodes + 1] - begin
        offsets = np.repeat(begin - np.cumsum(lengths) + lengths, lengths)
        there = self._neighbours[offsets + np.arange(lengths.sum())]
        return np.repeat(nodes, lengths), there


class _Parts:
    """What has been cut so far: the nodes of each front, and its children."""

    def __init__(self, graph: Graph, points: NDArray[np.float64]) -> None:
        self.found: list[tuple[Ints, tuple[int, ...]]] = []
        self._graph = graph
        self._points = points
        self._side = np.zeros(len(points), dtype=np.int8)

    def cut(self, nodes: Ints) -> tuple[int, ...]:
        """Cut these nodes; return the fronts that nothing of them is eliminated after."""
        if len(nodes) == 0:
            return ()
        sides = self._sides(nodes) if len(nodes) > LEAF else None
        if sides is None:
            own, children = self._sorted(nodes), ()
        else:
            own, *halves = sides
            children = tuple(front for half in halves for front in self.cut(half))
            if len(own) == 0:
                return children
            own = self._sorted(own)
        self.found.append((own, children))
        return (len(self.found) - 1,)

    def _sides(self, nodes: Ints) -> tuple[Ints, Ints, Ints] | None:
        """Return the cut and what it separates, or None where all nodes are in one place."""
        points = self._points[nodes]
        along = points[:, np.argmax(np.ptp(points, axis=0))]
        median = np.median(along)
        is_upper = along >= median
        if is_upper.all():
            is_upper = along > median
        if not is_upper.any():
            return None
        lower, upper = nodes[~is_upper], nodes[is_upper]
        side = self._side
        side[lower], side[upper] = 1, 2
        here, there = self._graph.edges(nodes)
        # Nodes of other parts have no side: 1 and 2 are all that make 3.
        touching = np.unique(here[side[here] + side[there] == 3])
        cuts = [touching[side[touching] == which] for which in (1, 2)]
        which = int(len(cuts[1]) < len(cuts[0]))
        side[cuts[which]] = 0
        lower, upper = lower[side[lower] == 1], upper[side[upper] == 2]
        side[nodes] = 0
        return cuts[which], lower, upper

    def _sorted(self, nodes: Ints) -> Ints:
        """Neighbours next to each other: along the longest extent, then along the others."""
        points = self._points[nodes]
        axes = np.argsort(np.ptp(points, axis=0), kind="stable")
        return nodes[np.lexsort(points[:, axes].T)]


def _with_borders(graph: Graph, parts: list[tuple[Ints, tuple[int, ...]]]) -> list[Front]:
    order = np.concatenate([own for own, _ in parts]) if parts else np.zeros(0, dtype=np.int64)
    place = np.zeros(int(order.max(initial=-1)) + 1, dtype=np.int64)
    place[order] = np.arange(len(order))
    fronts: list[Front] = []
    borders: list[Ints] = []
    for own, children in parts:
        _, there = graph.edges(own)
        reached = np.unique(np.concatenate([place[there], *[borders[c] for c in children]]))
        borders.append(reached[reached > place[own[-1]]])
        fronts.append(Front(own, order[borders[-1]], children))
    return fronts
