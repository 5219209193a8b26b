"""Multifrontal Cholesky on a nested dissection, on two cores: numpy and scipy alone."""

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.errors import FactorizationFailed
from fras_sim.fem.linear.blas import Dtype
from fras_sim.fem.linear.blas_threads import one_blas_thread
from fras_sim.fem.linear.dissection import Front, dissect
from fras_sim.fem.linear.part import Part
from fras_sim.fem.pattern import SparsityPattern
from fras_sim.fem.second_core import second_core

# With fewer operations than these one core is done before the second has been woken ...
WORTH_SPLITTING = 5_000_000
# ... likewise with a factor of fewer numbers, when it is substituted with.
WORTH_SHARING = 1_500_000

Ints = NDArray[np.int64]
T = TypeVar("T")


class MultifrontalCholesky:
    """Cholesky factorisation by dense fronts.

    Parameters
    ----------
    pattern : SparsityPattern
    dtype : float32 or float64
        Precision of the factor.

    Notes
    -----
    The nodes of each cut of a nested dissection are eliminated as one dense matrix, to which those
    of the two parts that it separates have added what they take off it (Duff, Reid, *ACM Trans.
    Math. Softw.* 9, 1983). The two sides of the last cut are independent: a core for each. BLAS is
    held to one thread meanwhile: threads of its own, on cores that others use, can cost a
    hundredfold.
    """

    def __init__(self, pattern: SparsityPattern, dtype: Dtype = np.float64) -> None:
        self.name = "scipy" if dtype is np.float64 else "scipy-single"
        self._n = pattern.n
        tree = dissect(pattern)
        groups, last = _halves(tree)
        separator = tree[last].own if last is not None else np.zeros(0, dtype=np.int64)
        self._halves = [Part(pattern, tree, group, separator, dtype) for group in groups]
        self._last = (
            None if last is None else Part(pattern, _alone(tree, last), [0], separator[:0], dtype)
        )
        self._shares_solving = sum(half.size for half in self._halves) > WORTH_SHARING

    @property
    def factor_bytes(self) -> int:
        """Size of the factor."""
        parts = self._halves if self._last is None else [*self._halves, self._last]
        return sum(part.factor_bytes for part in parts)

    def factorize(self, values: NDArray[np.float64]) -> None:
        """Take new entries and factor."""
        with one_blas_thread():
            failed = self._of_both(lambda half: half.eliminate(values), at_once=True)
            if self._last is not None:
                given = np.add(self._halves[0].schur, self._halves[1].schur)
                failed.append(self._last.eliminate(values, given))
        for row in failed:
            if row is not None:
                raise FactorizationFailed(
                    f"the matrix is not positive definite at row {row} of {self._n}: "
                    "check mass, stiffness and that no coordinate is infinite",
                    row=row,
                )

    def solve(self, rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return x with A x = rhs."""
        answer = np.empty(self._n)
        self._of_both(lambda half: half.forward(rhs), at_once=self._shares_solving)
        if self._last is not None:
            one, other = self._halves
            self._last.forward(rhs, one.separator + other.separator)
            solved = self._last.backward(answer)
            for half in self._halves:
                half.separator[:] = solved[: len(half.separator)]
        self._of_both(lambda half: half.backward(answer), at_once=self._shares_solving)
        return answer

    def _of_both(self, work: Callable[[Part], T], *, at_once: bool) -> list[T]:
        """Return what the work gives for either half, done at once if that is worth it."""
        if not (at_once and len(self._halves) == 2):
            return [work(half) for half in self._halves]
        results: dict[int, T] = {}

        def do(which: int) -> None:
            results[which] = work(self._halves[which])

        second_core.run(lambda: do(0), lambda: do(1))
        return [results[0], results[1]]


def _halves(tree: list[Front]) -> tuple[list[list[int]], int | None]:
    """Return the fronts for either core, and the one that follows both; else all for one."""
    everything = list(range(len(tree)))
    roots = set(everything) - {c for front in tree for c in front.children}
    if len(roots) != 1 or sum(front.cost for front in tree) < WORTH_SPLITTING:
        return [everything], None
    last = roots.pop()
    subtrees = [_subtree(tree, child) for child in tree[last].children]
    if len(subtrees) < 2:
        return [everything], None
    halves: list[list[int]] = [[], []]
    spent = [0.0, 0.0]
    for subtree in sorted(subtrees, key=lambda those: -_cost(tree, those)):
        which = int(spent[1] < spent[0])
        halves[which] += subtree
        spent[which] += _cost(tree, subtree)
    return [sorted(half) for half in halves], last


def _subtree(tree: list[Front], root: int) -> list[int]:
    found = [root]
    for front in found:
        found.extend(tree[front].children)
    return sorted(found)


def _cost(tree: list[Front], fronts: list[int]) -> float:
    return sum(tree[front].cost for front in fronts)


def _alone(tree: list[Front], front: int) -> list[Front]:
    """Return a tree of this front only, whose children are eliminated elsewhere."""
    return [Front(tree[front].own, tree[front].border, ())]
