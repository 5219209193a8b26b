"""Direct solvers for the symmetric positive definite systems of one fixed pattern."""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.errors import BadParameter
from fras_sim.fem.linear.multifrontal import MultifrontalCholesky
from fras_sim.fem.linear.pardiso import Pardiso
from fras_sim.fem.linear.single import SinglePrecision
from fras_sim.fem.pattern import SparsityPattern


class LinearSolver(Protocol):
    """Factor once, solve often; the pattern is fixed at construction."""

    @property
    def name(self) -> str:
        """What to call it in a log."""
        ...

    @property
    def factor_bytes(self) -> int:
        """Size of the factor: what a substitution reads twice."""
        ...

    def factorize(self, values: NDArray[np.float64]) -> None:
        """Take new entries, in the order of the pattern.

        Raises
        ------
        FactorizationFailed
            If the matrix is not positive definite.
        """
        ...

    def solve(self, rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return x with A x = rhs, shape (n,), for the entries given last."""
        ...


SOLVERS: dict[str, Callable[[SparsityPattern], LinearSolver]] = {
    "mkl": Pardiso,
    "mkl-single": lambda pattern: SinglePrecision(pattern, Pardiso),
    "scipy": MultifrontalCholesky,
    "scipy-single": lambda pattern: SinglePrecision(pattern, MultifrontalCholesky),
}
# Beats MKL on every body measured, 11x13x2 to 41x49x5 nodes, and needs no more than scipy.
FASTEST = "scipy-single"


def linear_solver(name: str, pattern: SparsityPattern) -> LinearSolver:
    """Return the solver of that name for a pattern.

    Parameters
    ----------
    name : str
        ``mkl`` (PARDISO) or ``scipy`` (multifrontal); with ``-single`` the factor is kept in
        float32, enough for a preconditioner. ``auto`` is what is fastest for a step; the solver's
        own name says which it became.
    pattern : SparsityPattern

    Raises
    ------
    BadParameter
        If there is none of that name.
    SolverUnavailable
        If MKL is asked for by name and can't be loaded.
    """
    name = FASTEST if name == "auto" else name
    if name not in SOLVERS:
        names = sorted({*SOLVERS, "auto"})
        raise BadParameter("solver", name, "one of " + ", ".join(names))
    return SOLVERS[name](pattern)
