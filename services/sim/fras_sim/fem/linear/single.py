"""A factor in single precision, and one in double where that is not enough."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.errors import FactorizationFailed
from fras_sim.fem.linear.multifrontal import MultifrontalCholesky
from fras_sim.fem.linear.pardiso import Pardiso
from fras_sim.fem.pattern import SparsityPattern


class SinglePrecision:
    """Factors in float32; in float64 what float32 finds not positive definite.

    Parameters
    ----------
    pattern : SparsityPattern
    kind : MultifrontalCholesky or Pardiso

    Notes
    -----
    Half the bytes and twice the arithmetic rate: the factor of a step is a preconditioner, which
    L-BFGS corrects with gradients in float64, so what is lost is 1e-5 of a step's length and not of
    the result's accuracy. Not for what needs a solution as exact as the matrix allows.
    """

    def __init__(
        self, pattern: SparsityPattern, kind: type[MultifrontalCholesky] | type[Pardiso]
    ) -> None:
        self._single = kind(pattern, np.float32)
        self._double: MultifrontalCholesky | Pardiso | None = None
        self._make_double: Callable[[], MultifrontalCholesky | Pardiso] = lambda: kind(pattern)
        self._now = self._single
        self.name = self._single.name

    @property
    def factor_bytes(self) -> int:
        """Size of the factor in use."""
        return self._now.factor_bytes

    def factorize(self, values: NDArray[np.float64]) -> None:
        """Take new entries and factor."""
        try:
            self._single.factorize(values)
            self._now = self._single
        except FactorizationFailed:
            self._double = self._double or self._make_double()
            self._double.factorize(values)
            self._now = self._double

    def solve(self, rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return x with A x = rhs, up to the precision of the factor."""
        return self._now.solve(rhs)
