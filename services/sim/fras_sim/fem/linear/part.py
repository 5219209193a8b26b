"""Fronts that one core eliminates and substitutes with, one after the other."""

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.linear import front_kernels as kernels
from fras_sim.fem.linear.blas import WIDTH, BlockRoutines, Dtype
from fras_sim.fem.linear.dissection import Front
from fras_sim.fem.pattern import SparsityPattern

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_NOTHING = np.zeros(0, dtype=np.int64)


class Part:
    """A subtree of fronts, or several, and behind them the separator that they reach.

    Parameters
    ----------
    pattern : SparsityPattern
    tree : list of Front
    fronts : list of int
        Which of the tree's, children before parents.
    separator : ndarray of int64
        The nodes that are eliminated after this part.
    dtype : float32 or float64

    Attributes
    ----------
    schur : ndarray, shape (m, m)
        What the elimination takes off the separator, a view: [j, i], i >= j, is its row i in
        column j.
    separator : ndarray, shape (m,)
        The separator's part of the right side or solution, a view.
    """

    def __init__(
        self,
        pattern: SparsityPattern,
        tree: list[Front],
        fronts: list[int],
        separator: Ints,
        dtype: Dtype,
    ) -> None:
        layout = _Layout(pattern, tree, fronts, separator)
        self._entries, self._places = layout.entries, layout.places
        self._rows, self._rows_at, self._row_at = layout.rows, layout.rows_at, layout.row_at
        self._idle, self._borders = layout.idle, layout.borders
        self._fronts, self._children, self._runs = layout.fronts, layout.children, layout.runs
        self._work = np.zeros(layout.work_size, dtype=dtype)
        self._stack = np.zeros(layout.stack_size, dtype=dtype)
        self._packed = np.zeros(int(layout.fronts[-1, kernels.PACKED]), dtype=dtype)
        self._x = np.zeros(layout.n_local, dtype=dtype)
        self._local = np.zeros(layout.tallest + kernels.ROWS, dtype=dtype)
        self._routines = BlockRoutines(dtype)
        self._calls = self._prepare_calls()
        m = layout.n_separator
        self.separator = self._x[layout.n_local - m :]
        at = int(layout.fronts[-2, kernels.UPDATE])
        self.schur = self._stack[at : at + m * m].reshape(m, m)
        self._none_given = np.zeros((0, 0), dtype=dtype)

    @property
    def size(self) -> int:
        """Numbers stored."""
        return self._packed.size

    @property
    def factor_bytes(self) -> int:
        """Size of the factor as it is substituted with."""
        return self._packed.nbytes

    def eliminate(self, values: Array, given: NDArray[np.floating] | None = None) -> int | None:
        """Take new entries and eliminate.

        Parameters
        ----------
        values : ndarray
            Of the pattern.
        given : ndarray, shape (m, m), optional
            Like `schur`, of the parts below, for the first front.

        Returns
        -------
        int or None
            The row of the matrix whose pivot is not positive, or not finite, if one isn't.
        """
        front = kernels.eliminate(
            values,
            self._fronts,
            self._children,
            self._runs,
            self._entries,
            self._places,
            self._idle,
            self._calls,
            self._routines.info,
            self._none_given if given is None else given,
            self._work,
            self._stack,
            self._packed,
        )
        if front < 0:
            return None
        row = self._fronts[front, kernels.FIRST] + max(int(self._routines.info[0]) - 1, 0)
        return int(self._row_at[row])

    def forward(self, rhs: Array, given: NDArray[np.floating] | None = None) -> None:
        """Take the right side and substitute forwards; `given` is added to the first rows."""
        self._x[:] = 0.0
        if given is not None:
            self._x[: len(given)] = given
        kernels.all_forward(rhs, self._rows, self._rows_at, *self._factor)

    def backward(self, answer: Array) -> NDArray[np.floating]:
        """Substitute backwards and put the solution where it belongs.

        Returns
        -------
        ndarray
            The solution in the order of elimination, idle rows included.
        """
        kernels.all_backward(self._rows, self._rows_at, *self._factor, answer)
        return self._x

    @property
    def _factor(
        self,
    ) -> tuple[Ints, Ints, NDArray[np.floating], NDArray[np.floating], NDArray[np.floating]]:
        return self._fronts, self._borders, self._packed, self._x, self._local

    def _prepare_calls(self) -> Ints:
        """Return the calls of BLAS of all fronts, and write into the table where each begin."""
        work, size = self._work.ctypes.data, self._work.itemsize
        calls: list[list[int]] = []
        for front in self._fronts[:-1]:
            own, height = int(front[kernels.OWN]), int(front[kernels.ALL])
            border = height - own
            front[kernels.CALLS] = len(calls)
            if own > 0:
                calls.append(self._routines.cholesky(own, work, height))
            if own > 0 and border > 0:
                below = work + size * own
                update = self._stack.ctypes.data + size * int(front[kernels.UPDATE])
                calls.append(self._routines.divide(border, own, below, work, height))
                calls.append(
                    self._routines.subtract_square(border, own, update, border, below, height)
                )
        self._fronts[-1, kernels.CALLS] = len(calls)
        return np.array(calls, dtype=np.int64).reshape(-1, WIDTH)


class _Layout:
    """Where everything of a part goes; see `front_kernels` for the tables.

    Rows are numbered in the order of elimination, with idle ones that fill up each front's own to a
    multiple of four; those of the separator come last. A last front without own rows collects what
    its children take off the separator.
    """

    def __init__(
        self, pattern: SparsityPattern, tree: list[Front], fronts: list[int], separator: Ints
    ) -> None:
        members = [tree[k] for k in fronts]
        local = {k: i for i, k in enumerate(fronts)}
        n_own = [3 * len(front.own) for front in members]
        padded = [-(-n // kernels.COLUMNS) * kernels.COLUMNS for n in n_own]
        first = np.concatenate([[0], np.cumsum(padded)]).astype(np.int64)
        self.n_separator = 3 * len(separator)
        self.n_local = int(first[-1]) + self.n_separator

        rows = [pattern.row_of[front.own].ravel() for front in members]
        rows_at = [f + np.arange(n) for f, n in zip(first[:-1], n_own, strict=True)]
        self.rows = np.concatenate([*rows, _NOTHING]).astype(np.int64)
        self.rows_at = np.concatenate([*rows_at, _NOTHING]).astype(np.int64)
        self.row_at = np.full(self.n_local, -1)
        self.row_at[self.rows_at] = self.rows
        place = np.full(pattern.n, -1)
        place[self.rows] = self.rows_at
        place[pattern.row_of[separator].ravel()] = np.arange(int(first[-1]), self.n_local)

        borders = [place[pattern.row_of[front.border].ravel()] for front in members]
        borders.append(np.arange(int(first[-1]), self.n_local))
        padded.append(0)
        children = [[local[c] for c in front.children] for front in members]
        has_parent = {c for those in children for c in those}
        children.append([i for i in range(len(members)) if i not in has_parent])

        n_fronts = len(borders)
        table = np.zeros((n_fronts + 1, 10), dtype=np.int64)
        table[:-1, kernels.FIRST] = first
        table[:-1, kernels.OWN] = padded
        sizes = np.array([len(border) for border in borders])
        table[:-1, kernels.ALL] = table[:-1, kernels.OWN] + sizes
        heights = table[:-1, kernels.ALL]
        packed = [kernels.packed_size(*map(int, x)) for x in zip(padded, heights, strict=True)]
        table[1:, kernels.PACKED] = np.cumsum(packed)
        table[1:, kernels.BORDER] = np.cumsum(sizes)
        table[1:, kernels.CHILDREN] = np.cumsum([len(those) for those in children])
        self.fronts = table
        self.borders = np.concatenate(borders).astype(np.int64)
        self.tallest = int(heights.max())
        self.work_size = int((table[:-1, kernels.OWN] * heights).max())
        self.stack_size = _stack_updates(table, children, sizes)
        self._connect(table, children, borders)
        self._place_entries(pattern, table, place, first)

        idle = [np.arange(3 * len(f.own), p) for f, p in zip(members, padded, strict=False)]
        idle_at = [i * (h + 1) for i, h in zip(idle, heights, strict=False)]
        self.idle = np.concatenate([*idle_at, _NOTHING]).astype(np.int64)
        table[1:, kernels.IDLE] = np.cumsum([*map(len, idle), 0])

    def _connect(self, table: Ints, children: list[list[int]], borders: list[Ints]) -> None:
        """Say which rows of a child are which of its parent's."""
        rows: list[tuple[int, int, int]] = []
        runs: list[Ints] = []
        n_runs = 0
        for parent, those in enumerate(children):
            for child in those:
                to = _rows_in(table[parent], borders[parent], borders[child])
                starts = np.flatnonzero(np.diff(to, prepend=-2) != 1)
                ends = np.append(starts, len(to))[1:]
                rows.append((int(table[child, kernels.UPDATE]), len(to), n_runs))
                runs.append(np.stack([to[starts], starts, ends], axis=1))
                n_runs += len(starts)
        rows.append((0, 0, n_runs))
        self.children = np.array(rows, dtype=np.int64)
        self.runs = np.concatenate([*runs, np.zeros((0, 3), dtype=np.int64)]).astype(np.int64)

    def _place_entries(
        self, pattern: SparsityPattern, table: Ints, place: Ints, first: Ints
    ) -> None:
        """Sort the entries by the front of the one of their rows that is eliminated first."""
        one, other = place[pattern.rows], place[pattern.indices]
        low, high = np.minimum(one, other), np.maximum(one, other)
        here = np.flatnonzero((low >= 0) & (low < first[-1]))
        front = np.searchsorted(first, low[here], side="right") - 1
        here = here[np.argsort(front, kind="stable")]
        front.sort()
        column, row = low[here] - first[front], high[here] - first[front]
        # In the border of its front each row is found by the number of both.
        n = self.n_local
        keys = np.repeat(np.arange(len(table) - 1), np.diff(table[:, kernels.BORDER])) * n
        found = np.searchsorted(keys + self.borders, front * n + high[here])
        own, height = table[front, kernels.OWN], table[front, kernels.ALL]
        row = np.where(row < own, row, own + found - table[front, kernels.BORDER])
        self.entries = here
        self.places = column * height + row
        table[:, kernels.ENTRIES] = np.searchsorted(front, np.arange(len(table)))


def _rows_in(front: Ints, border: Ints, rows: Ints) -> Ints:
    """Return the rows of a front at which these local rows are."""
    found = rows - front[kernels.FIRST]
    is_behind = found >= front[kernels.OWN]
    found[is_behind] = front[kernels.OWN] + np.searchsorted(border, rows[is_behind])
    return found


def _stack_updates(table: Ints, children: list[list[int]], sizes: Ints) -> int:
    """Write into the table where each front's update goes; return the room for all.

    There are two stacks, in turns for the generations: a front's update goes onto the one while its
    children's, no longer needed then, are taken from the top of the other.
    """
    generation = np.zeros(len(children), dtype=np.int64)
    for parent in range(len(children) - 1, -1, -1):
        generation[children[parent]] = generation[parent] + 1
    top, most = [0, 0], [0, 0]
    for k, those in enumerate(children):
        stack = int(generation[k] % 2)
        table[k, kernels.UPDATE] = top[stack]
        top[stack] += int(sizes[k]) ** 2
        most[stack] = max(most[stack], top[stack])
        top[1 - stack] -= sum(int(sizes[c]) ** 2 for c in those)
    table[np.flatnonzero(generation % 2), kernels.UPDATE] += most[0]
    return sum(most)
