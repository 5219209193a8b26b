"""Solving that ends in time."""

from collections.abc import Callable, Sequence

import clingo


class OutOfTime(Exception):
    """The time for one answer is over; the Control is as it was and can be asked again."""


class Search:
    """Searches of one Control that share a limit of time.

    Time decides only whether there is an answer, never which: what was found until then is dropped,
    so that the same question always has the same answer.

    Parameters
    ----------
    control : clingo.Control
    limit_s : float
        Seconds from `begin` until all searches must have ended.
    clock : callable
        Returns seconds.
    """

    def __init__(self, control: clingo.Control, limit_s: float, clock: Callable[[], float]) -> None:
        self._control = control
        self._limit_s = limit_s
        self._clock = clock
        self._began_s = 0.0

    def begin(self) -> None:
        """Begin a new answer."""
        self._began_s = self._clock()

    def __call__(
        self,
        assumptions: Sequence[int] = (),
        on_model: Callable[[clingo.Model], None] | None = None,
    ) -> tuple[clingo.SolveResult, list[int]]:
        """Solve under literals that are assumed.

        Returns
        -------
        result : clingo.SolveResult
        core : list of int
            Assumptions that together leave no model; empty where there is one.

        Raises
        ------
        OutOfTime
        """
        left_s = self._limit_s - (self._clock() - self._began_s)
        if left_s <= 0:
            raise OutOfTime
        with self._control.solve(assumptions, on_model=on_model, async_=True) as handle:
            if not handle.wait(left_s):
                handle.cancel()
                raise OutOfTime
            result = handle.get()
            return result, handle.core() if result.unsatisfiable else []


class Best:
    """The best model so far; one that was not taken yet is empty."""

    def __init__(self) -> None:
        self.atoms: list[clingo.Symbol] = []
        self.candidates = 0
        self.cost: tuple[int, ...] = ()
        self.levels: tuple[int, ...] = ()
        self.models = 0

    def take(self, model: clingo.Model) -> None:
        """Keep a model, better than the one before."""
        shown = model.symbols(shown=True)
        # There may be thousands of candidates; only their number is told.
        self.atoms = [atom for atom in shown if atom.name != "candidate"]
        self.candidates = len(shown) - len(self.atoms)
        self.cost = tuple(model.cost)
        self.levels = tuple(model.priority)
        self.models += 1

    def named(self, name: str) -> list[list[clingo.Symbol]]:
        """Arguments of the atoms of that name."""
        return sorted(atom.arguments for atom in self.atoms if atom.name == name)
